#include "server/sequence/digest.h"

#include <span>
#include <type_traits>

#include "ies/writers.h"
#include "server/base/sha256.h"
#include "server/scene/body.h"
#include "server/scene/packed_gobo.h"

namespace gonio::sequence {
namespace {

class Digest {
public:
    void add(const void* bytes, std::size_t count) { digest_.add(bytes, count); }
    template <typename T>
    requires std::is_arithmetic_v<T>
    void add(T number) { add(&number, sizeof number); }
    void add(std::string_view text) {
        add(text.size());
        add(text.data(), text.size());
    }
    // T: numbers without gaps between them.
    template <typename T>
    void add_all(std::span<const T> values) {
        add(values.size());
        add(values.data(), values.size_bytes());
    }
    std::string text() { return digest_.text(); }

private:
    Sha256 digest_;
};

void add_material(Digest& digest, const Material& material) {
    for (int i = 0; i < 4; ++i) digest.add(material.base_color[i]);
    for (int i = 0; i < 3; ++i) digest.add(material.emissive_nit[i]);
    for (const int image :
         {material.base_color_image, material.emissive_image, material.normal_image, material.transmission_image,
          static_cast<int>(material.wrap_s), static_cast<int>(material.wrap_t)})
        digest.add(image);
    for (const float number : {material.normal_scale, material.alpha_cutoff, material.transmission}) digest.add(number);
    for (const bool flag : {material.alpha_mask, material.alpha_blend, material.double_sided, material.show_back})
        digest.add(flag);
}

void add_point(Digest& digest, const glm::dvec3& point) {
    for (int i = 0; i < 3; ++i) digest.add(point[i]);
}

void add_light(Digest& digest, const LightSeed& light) {
    digest.add(std::string_view(light.name));
    add_point(digest, light.position);
    for (const glm::dquat& turn : {light.world_from_light, light.world_from_mount})
        for (int i = 0; i < 4; ++i) digest.add(turn[i]);
    add_point(digest, light.color);
    digest.add(light.multiplier);
    digest.add(light.sun);
    if (light.profile) digest.add(std::string_view(ies::write_lm63(light.profile->photometry)));
    if (light.profile && light.profile->gobos)
        for (const Gobo& gobo : *light.profile->gobos) {
            digest.add_all(std::span<const std::uint16_t>(gobo.transmission));
            if (gobo.packed) digest.add(std::string_view(gobo.packed->bytes));
        }
}

void add_matrix(Digest& digest, const glm::dmat4& matrix) {
    for (int column = 0; column < 4; ++column)
        for (int row = 0; row < 4; ++row) digest.add(matrix[column][row]);
}

void add_shown(Digest& digest, const SceneAsset& asset) {
    for (const Mesh& mesh : asset.meshes) {
        digest.add_all(std::span<const Vertex>(mesh.vertices));
        digest.add_all(std::span<const glm::u16vec4>(mesh.colors));
        digest.add_all(std::span<const glm::vec4>(mesh.tangents));
        digest.add_all(std::span<const std::uint32_t>(mesh.indices));
        digest.add(mesh.material);
    }
    for (const Material& material : asset.materials) add_material(digest, material);
    for (const Image& image : asset.images) {
        digest.add(image.width_px);
        digest.add(image.linear);
        digest.add_all(std::span<const std::uint8_t>(image.rgba));
    }
    for (const Instance& instance : asset.instances) {
        digest.add(instance.mesh);
        digest.add(std::string_view(instance.node));
        add_matrix(digest, instance.world_from_mesh);
    }
}

void add_bodies(Digest& digest, const Bodies& bodies) {
    digest.add(std::string_view("bodies"));
    add_shown(digest, bodies.shown);
    for (const BodyMount& mount : bodies.mounts) {
        digest.add(mount.seed);
        add_matrix(digest, mount.world_from_fixture);
        digest.add(mount.joints.size());
        for (const BodyJoint& joint : mount.joints) {
            add_point(digest, joint.point);
            add_point(digest, joint.axis);
        }
        add_point(digest, mount.aim);
        digest.add(mount.pan_rad);
        digest.add(mount.side);
    }
    for (const BodyPart& part : bodies.parts) {
        digest.add(part.mount);
        digest.add(part.joints);
    }
}

}  // namespace

std::string sha256_of_asset(const SceneAsset& asset) {
    Digest digest;
    add_shown(digest, asset);
    for (const LightSeed& light : asset.lights) add_light(digest, light);
    if (asset.bodies) add_bodies(digest, *asset.bodies);
    return digest.text();
}

}  // namespace gonio::sequence

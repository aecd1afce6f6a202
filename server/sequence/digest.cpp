#include "server/sequence/digest.h"

#include <span>
#include <type_traits>

#include "ies/writers.h"
#include "server/base/sha256.h"

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

void add_light(Digest& digest, const LightSeed& light) {
    digest.add(std::string_view(light.name));
    for (int i = 0; i < 3; ++i) digest.add(light.position[i]);
    for (int i = 0; i < 4; ++i) digest.add(light.world_from_light[i]);
    for (int i = 0; i < 3; ++i) digest.add(light.color[i]);
    digest.add(light.multiplier);
    digest.add(light.sun);
    if (light.profile) digest.add(std::string_view(ies::write_lm63(light.profile->photometry)));
    if (light.profile && light.profile->gobos)
        for (const Gobo& gobo : *light.profile->gobos)
            digest.add(gobo.transmission.data(), gobo.transmission.size() * sizeof(gobo.transmission[0]));
}

}  // namespace

std::string sha256_of_asset(const SceneAsset& asset) {
    Digest digest;
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
        for (int column = 0; column < 4; ++column)
            for (int row = 0; row < 4; ++row) digest.add(instance.world_from_mesh[column][row]);
    }
    for (const LightSeed& light : asset.lights) add_light(digest, light);
    return digest.text();
}

}  // namespace gonio::sequence

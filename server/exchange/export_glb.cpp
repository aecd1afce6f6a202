#include "server/exchange/export_glb.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <vector>

#include "server/assets/assets.h"
#include "server/assets/glb_writer.h"
#include "server/exchange/export_light.h"
#include "server/scene/limits.h"
#include "server/scene/scene.h"

namespace gonio::exchange {
namespace {

using Json = GlbWriter::Json;

class GeometryWriter {
public:
    GeometryWriter(GlbWriter& glb, const SceneAsset& asset, std::function<void()> wrote_image = {})
        : glb_(glb), asset_(asset), wrote_image_(std::move(wrote_image)) {}

    // Adds the instance with what it shows, each part once.
    std::optional<Error> add(const Instance& instance, bool in_world) {
        const Mesh& mesh = asset_.meshes[static_cast<std::size_t>(instance.mesh)];
        if (auto error = add_material(mesh.material)) return error;
        // Readers turn a mesh where its node mirrors it, as glTF says; the scene's mesh has been turned already.
        const bool turned = glm::determinant(glm::dmat3(instance.world_from_mesh)) < 0.0;
        const auto [at, fresh] = meshes_.try_emplace({instance.mesh, turned}, 0u);
        if (fresh) at->second = add(mesh, turned);
        if (glb_.binary_bytes() > kMostSavedBytes) return too_large_scene();
        Json node = {{"name", instance.node}, {"mesh", at->second}};
        if (in_world) node["matrix"] = GlbWriter::matrix_of(instance.world_from_mesh);
        glb_.add("nodes", std::move(node));
        return std::nullopt;
    }
    const std::set<std::string>& extensions() const { return extensions_; }

private:
    std::optional<Error> add_texture(const Material& material, int image, int& texture) {
        if (image < 0) return std::nullopt;
        const auto [at, fresh] = images_.try_emplace(image, 0u);
        if (fresh) {
            const auto png = encode_rgba_png(asset_.images[static_cast<std::size_t>(image)]);
            if (!png) return png.error();
            at->second = glb_.add_image(*png);
            if (wrote_image_) wrote_image_();
            if (glb_.binary_bytes() > kMostSavedBytes) return too_large_scene();
        }
        texture = static_cast<int>(glb_.add_texture(at->second, material.wrap_s, material.wrap_t));
        return std::nullopt;
    }

    std::optional<Error> add_material(int index) {
        const auto [at, fresh] = materials_.try_emplace(index, 0u);
        if (!fresh) return std::nullopt;
        const Material& from = asset_.materials[static_cast<std::size_t>(index)];
        int base = -1, emission = -1, normal = -1, transmission = -1;
        for (const auto& [image, texture] :
             {std::pair(from.base_color_image, &base), std::pair(from.emissive_image, &emission),
              std::pair(from.normal_image, &normal), std::pair(from.transmission_image, &transmission)})
            if (auto error = add_texture(from, image, *texture)) return error;
        Json material = GlbWriter::material_of(from, base);
        const glm::dvec3 nit(from.emissive_nit);
        if (const double most = std::max({nit.r, nit.g, nit.b}); most > 0.0) {
            const double strength = std::max(most, 1.0);
            material["emissiveFactor"] = {nit.r / strength, nit.g / strength, nit.b / strength};
            if (strength > 1.0) extension(material, "KHR_materials_emissive_strength")["emissiveStrength"] = strength;
        }
        if (emission >= 0) material["emissiveTexture"] = {{"index", emission}};
        if (normal >= 0) material["normalTexture"] = {{"index", normal}, {"scale", from.normal_scale}};
        if (from.transmission > 0.0f) {
            Json& pane = extension(material, "KHR_materials_transmission");
            pane["transmissionFactor"] = from.transmission;
            if (transmission >= 0) pane["transmissionTexture"] = {{"index", transmission}};
        }
        if (from.double_sided) material["doubleSided"] = true;
        at->second = glb_.add("materials", std::move(material));
        return std::nullopt;
    }

    Json& extension(Json& of, const char* name) {
        extensions_.insert(name);
        return of["extensions"][name];
    }

    std::size_t add(const Mesh& mesh, bool turned) {
        std::vector<glm::vec3> positions, normals;
        std::vector<glm::vec2> uvs;
        bool has_uv = false;
        for (const Vertex& vertex : mesh.vertices) {
            positions.push_back(vertex.position);
            normals.push_back(turned ? -vertex.normal : vertex.normal);
            uvs.push_back(vertex.uv);
            has_uv |= vertex.uv != glm::vec2(0.0f);
        }
        Json attributes = {{"POSITION", glb_.add_positions(positions)},
                           {"NORMAL", glb_.add_accessor(normals, GlbWriter::kFloat, "VEC3")}};
        if (!mesh.tangents.empty()) {
            std::vector<glm::vec4> tangents = mesh.tangents;
            if (turned)
                for (glm::vec4& tangent : tangents) tangent.w = -tangent.w;
            attributes["TANGENT"] = glb_.add_accessor(tangents, GlbWriter::kFloat, "VEC4");
        }
        if (has_uv) attributes["TEXCOORD_0"] = glb_.add_accessor(uvs, GlbWriter::kFloat, "VEC2");
        if (!mesh.second_uv.empty())
            attributes["TEXCOORD_1"] = glb_.add_accessor(mesh.second_uv, GlbWriter::kFloat, "VEC2");
        if (!mesh.colors.empty())
            attributes["COLOR_0"] =
                glb_.add_accessor(mesh.colors, GlbWriter::kUnsignedShort, "VEC4", {{"normalized", true}});
        std::vector<std::uint32_t> indices = mesh.indices;
        if (turned)
            for (std::size_t i = 0; i + 2 < indices.size(); i += 3) std::swap(indices[i + 1], indices[i + 2]);
        Json primitive = {{"attributes", std::move(attributes)},
                          {"indices", glb_.add_accessor(indices, GlbWriter::kUnsignedInt, "SCALAR")},
                          {"material", materials_.at(mesh.material)}};
        return glb_.add("meshes", {{"primitives", Json::array({std::move(primitive)})}});
    }

    GlbWriter& glb_;
    const SceneAsset& asset_;
    std::function<void()> wrote_image_;
    std::map<int, std::size_t> images_, materials_;  // of the asset -> of the file
    std::map<std::pair<int, bool>, std::size_t> meshes_;
    std::set<std::string> extensions_;
};

// Result: the node of a light, without what says which light it is. Its level is told apart for ourselves: it is 0
// where the shutter is closed, as is the node's multiplier.
Json node_of(const Light& light, double master_ratio) {
    const glm::dquat& turn = light.world_from_light;
    return {{"name", light.name},
            {"translation", {light.position.x, light.position.y, light.position.z}},
            {"rotation", {turn.x, turn.y, turn.z, turn.w}},
            {"extras",
             {{"gonio",
               {{"level_ratio", shown_level(light, master_ratio)},
                {"multiplier", color_of(light).multiplier * light.multiplier}}}}}};
}

Json numbers(const glm::dvec3& color) {
    return {color.r, color.g, color.b};
}

class LightWriter {
public:
    explicit LightWriter(GlbWriter& glb) : glb_(glb) {}

    std::optional<Error> add(const Light& light, double master_ratio) {
        const LightScale scale = scale_of(light, master_ratio);
        if (const auto punctual = punctual_of(light))
            return add_punctual(light, *punctual, scale, node_of(light, master_ratio)), std::nullopt;
        if (scale.multiplier > kMostMultiplier)
            return Error{"too_large", light.name, std::to_string(scale.multiplier),
                         "level, multiplier and colour of a light are at most 1e9 together in glTF"};
        const auto [at, fresh] = files_.try_emplace(ies_key_of(light));
        if (fresh) {
            at->second = {files_.size() - 1, fallback_of(light)};
            const auto text = ies_file_of(light);
            if (!text) return text.error();
            const std::size_t view = glb_.add_view(text->data(), text->size());
            lights("EXT_lights_ies")
                .push_back(
                    {{"name", light.profile->name}, {"mimeType", "application/x-ies-lm-63"}, {"bufferView", view}});
            if (glb_.binary_bytes() > kMostSavedBytes) return too_large_scene();
        }
        Json node = node_of(light, master_ratio);
        node["extensions"]["EXT_lights_ies"] = {
            {"light", at->second.index}, {"multiplier", scale.multiplier}, {"color", numbers(scale.color)}};
        const PunctualFallback& fallback = at->second.fallback;
        add_punctual(light, fallback.light, {scale.multiplier * fallback.cd, scale.color}, std::move(node));
        return std::nullopt;
    }
    const std::set<std::string>& extensions() const { return extensions_; }

private:
    void add_punctual(const Light& light, const PunctualLight& punctual, const LightScale& scale, Json node) {
        Json made = {{"name", light.name},
                     {"type", punctual.type},
                     {"color", numbers(scale.color)},
                     {"intensity", scale.multiplier}};
        if (punctual.outer_rad > 0.0)
            made["spot"] = {{"innerConeAngle", punctual.inner_rad}, {"outerConeAngle", punctual.outer_rad}};
        Json& list = lights("KHR_lights_punctual");
        list.push_back(std::move(made));
        node["extensions"]["KHR_lights_punctual"] = {{"light", list.size() - 1}};
        glb_.add("nodes", std::move(node));
    }
    Json& lights(const char* extension) {
        extensions_.insert(extension);
        return glb_.document["extensions"][extension]["lights"];
    }

    GlbWriter& glb_;
    struct File {
        std::size_t index = 0;      // of EXT_lights_ies
        PunctualFallback fallback;  // beside it
    };
    std::map<std::string, File> files_;  // by ies_key_of()
    std::set<std::string> extensions_;
};

// The camera of a scene without surfaces is nowhere.
bool is_aimed(const Camera& camera) {
    const double distance = glm::distance(camera.eye, camera.target);
    return distance > 0.0 && std::isfinite(distance);
}

std::string finish(GlbWriter& glb, const std::set<std::string>& extensions) {
    if (!extensions.empty()) glb.document["extensionsUsed"] = extensions;
    return glb.file();
}

}  // namespace

Result<std::string> export_glb(const Scene& scene, const Parts& each) {
    const SceneAsset& asset = *scene.asset;
    // Images take the time.
    std::size_t done = 0;
    const auto tell = [&] {
        if (each) each(++done, asset.images.size() + 2);
    };
    GlbWriter glb;
    GeometryWriter geometry(glb, asset, tell);
    for (const Instance& instance : asset.instances)
        if (auto error = geometry.add(instance, true)) return *error;
    tell();
    LightWriter lights(glb);
    for (const Light& light : scene.lights)
        if (auto error = lights.add(light, scene.master_ratio)) return *error;
    tell();
    if (is_aimed(scene.camera)) glb.add_camera(scene.camera, "camera");
    for (const auto& [name, view] : scene.saved_views)
        if (is_aimed(view)) glb.add_camera(view, name);
    std::set<std::string> extensions = geometry.extensions();
    extensions.insert(lights.extensions().begin(), lights.extensions().end());
    std::string bytes = finish(glb, extensions);
    if (bytes.size() > kMostSavedBytes) return too_large_scene();
    return bytes;
}

Result<std::string> export_geometry(const SceneAsset& asset, std::span<const std::size_t> instances, bool in_world) {
    GlbWriter glb;
    GeometryWriter geometry(glb, asset);
    for (const std::size_t index : instances)
        if (auto error = geometry.add(asset.instances[index], in_world)) return *error;
    return finish(glb, geometry.extensions());
}

}  // namespace gonio::exchange

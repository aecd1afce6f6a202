// glTF materials, textures and images -> Material and Image.
#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <string>
#include <tuple>

#include "server/assets/assets.h"
#include "server/assets/gltf_features.h"
#include "server/assets/gltf_import.h"

namespace gonio {
namespace {

using tinygltf::Value;

// An image that cannot be read counts by what its header says: decoding it may take as long as a whole one.
Result<Image> decode_counted(GltfImport& import, std::span<const std::byte> bytes, const std::string& where) {
    const std::size_t room = std::min(kMaxSceneTexels - import.texels, import.room / kBytesOfTexel);
    auto image = decode_image(bytes, where, room);
    if (image) return image;
    if (const auto size = image_size(bytes, where, room))
        import.texels += static_cast<std::size_t>(size->width_px) * static_cast<std::size_t>(size->height_px);
    return image;
}

Result<Image> load_image(GltfImport& import, int index) {
    const GltfDocument& document = import.document;
    const auto& source = document.images[index];
    const std::string where = "/images/" + std::to_string(index);
    if (source.uri.empty()) {
        if (source.buffer_view < 0) return Error{"bad_gltf", where, "", "an image without uri and bufferView"};
        return decode_counted(import, view_bytes(document, source.buffer_view), where + "/bufferView");
    }
    const auto bytes = read_uri(document.directory, source.uri, where + "/uri", kMaxSceneFileBytes, kMaxSceneFileBytes);
    if (!bytes) return bytes.error();
    auto image = decode_counted(import, *bytes, where + "/uri");
    if (image) return image;
    Error error = image.error();
    if (error.value.empty()) error.value = shown_uri(source.uri);
    return error;
}

// Result: the texture's image, WebP before PNG and JPEG; -1 if it has none of them.
int source_of(const tinygltf::Texture& texture) {
    const auto webp = texture.extensions.find("EXT_texture_webp");
    const bool named = webp != texture.extensions.end() && webp->second.Has("source");
    return named ? webp->second.Get("source").GetNumberAsInt() : texture.source;
}

// The warning of a texture without such an image.
std::string left_out(const tinygltf::Texture& texture, const std::string& where) {
    for (const FeatureName feature :
         {FeatureName("KHR_texture_basisu"), FeatureName("EXT_texture_avif"), FeatureName("MSFT_texture_dds")}) {
        if (texture.extensions.count(std::string(feature.row().name)))
            return feature_warning(feature, where, "the texture is left out");
    }
    return "a texture without an image was left out; changes lux (" + where + ")";
}

// Whether an image that cannot be read is left out, and the rest of the scene stays: not where it is memory that lacks,
// or what reads pictures.
bool is_of_one_image(const Error& error) {
    return error.code != "too_large" && error.where.starts_with("/images/");
}

// The warning of such an image: why, and where.
std::string image_left_out(const Error& error) {
    const bool named = !error.value.empty() && !is_data_uri(error.value);
    return "an image was left out, " + error.message + "; changes lux (" + error.where +
           (named ? ": " + error.value : "") + ")";
}

// image: becomes an index into scene.images, or -1 for a texture that has none that can be read. wrap_into: takes the
// sampler's modes. linear: of the image.
std::optional<Error> import_texture(GltfImport& import, int texture_index, int& image, Material* wrap_into,
                                    bool linear = false) {
    const tinygltf::Model& model = *import.document.model;
    const tinygltf::Texture& texture = model.textures[texture_index];
    if (texture.sampler >= 0 && wrap_into) {
        const auto& sampler = model.samplers[texture.sampler];
        const std::string place = "/samplers/" + std::to_string(texture.sampler);
        for (const auto& [mode, wrap, member] : {std::tuple(sampler.wrapS, &wrap_into->wrap_s, "/wrapS"),
                                                 std::tuple(sampler.wrapT, &wrap_into->wrap_t, "/wrapT")}) {
            if (mode == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE) {
                *wrap = Wrap::clamp;
            } else if (mode == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT) {
                *wrap = Wrap::mirror;
            } else if (mode == TINYGLTF_TEXTURE_WRAP_REPEAT) {
                *wrap = Wrap::repeat;
            } else {
                import.warn("there is no such wrap mode: the texture repeats; changes lux (" + place + member + ": " +
                            std::to_string(mode) + ")");
            }
        }
    }
    const int source = source_of(texture);
    if (source < 0) {
        import.warn(left_out(texture, "/textures/" + std::to_string(texture_index)));
        return std::nullopt;
    }
    const auto [known, is_new] =
        import.images.emplace(std::pair(source, linear), static_cast<int>(import.scene.images.size()));
    image = known->second;
    if (!is_new) return std::nullopt;
    auto loaded = load_image(import, source);
    if (!loaded) {
        if (!is_of_one_image(loaded.error())) return loaded.error();
        import.warn(image_left_out(loaded.error()));
        known->second = image = -1;
        return std::nullopt;
    }
    const std::size_t texels = loaded->rgba.size() / 4;
    import.texels += texels;
    loaded->linear = linear;
    import.scene.images.push_back(std::move(*loaded));
    return take_memory(import.room, texels, kBytesOfTexel, "/images");
}

// Result: of KHR_materials_transmission, index -1: none.
tinygltf::TextureInfo transmission_texture(const tinygltf::Material& from) {
    tinygltf::TextureInfo texture;
    const auto found = from.extensions.find("KHR_materials_transmission");
    if (found == from.extensions.end() || !found->second.Has("transmissionTexture")) return texture;
    const Value& value = found->second.Get("transmissionTexture");
    texture.index = static_cast<int>(number_of(value, "index", -1.0));
    texture.texCoord = static_cast<int>(number_of(value, "texCoord", 0.0));
    return texture;
}

// first: no other texture of the material has wrap modes. Result: nothing, or the error of load_scene.
std::optional<Error> import_transmission(GltfImport& import, const tinygltf::Material& from, bool first,
                                         const std::string& where, Material& material) {
    const auto found = from.extensions.find("KHR_materials_transmission");
    if (found == from.extensions.end()) return std::nullopt;
    const double factor = number_of(found->second, "transmissionFactor", 0.0);
    if (factor < 0.0 || factor > 1.0)
        import.warn("a transmissionFactor outside 0..1 was clamped; changes lux (" + where + ")");
    material.transmission = static_cast<float>(std::clamp(factor, 0.0, 1.0));
    if (!(material.transmission > 0.0f)) return std::nullopt;
    const glm::vec4& color = material.base_color;
    if (color.r != color.g || color.g != color.b || material.base_color_image >= 0)
        import.warn(
            "coloured glass dims lux in the live picture by its luminance; direct light of meters, what is seen "
            "through it and the reference have its colour; changes lux (" +
            where + ")");
    const tinygltf::TextureInfo texture = transmission_texture(from);
    if (texture.index < 0) return std::nullopt;
    return import_texture(import, texture.index, material.transmission_image, first ? &material : nullptr, true);
}

Result<Material> convert(GltfImport& import, const tinygltf::Material& from, const std::string& where) {
    Material material;
    material.name = from.name;
    const BaseColour base = base_colour_of(from);
    for (int c = 0; c < 4; ++c) {
        if (base.factor[c] < 0.0 || base.factor[c] > 1.0)
            import.warn("a baseColorFactor outside 0..1 was clamped; changes lux (" + where + ")");
        material.base_color[c] = static_cast<float>(std::clamp(base.factor[c], 0.0, 1.0));
    }
    const auto strength = from.extensions.find("KHR_materials_emissive_strength");
    const double nits = strength == from.extensions.end() || !strength->second.Has("emissiveStrength")
                            ? 1.0
                            : strength->second.Get("emissiveStrength").GetNumberAsDouble();
    for (int c = 0; c < 3; ++c) {
        const double value = from.emissiveFactor[c] * nits;
        if (value < 0.0 || value > 1e12) {
            return Error{"bad_gltf", where + "/emissiveFactor", std::to_string(value),
                         "the emission must be between 0 and 1e12 cd/m²"};
        }
        material.emissive_nit[c] = static_cast<float>(value);
    }
    if (from.alphaMode == "MASK") {
        material.alpha_mask = true;
        material.alpha_cutoff = static_cast<float>(from.alphaCutoff);
    } else if (from.alphaMode == "BLEND") {
        material.alpha_blend = true;
    } else if (from.alphaMode != "OPAQUE") {
        return Error{"bad_gltf", where + "/alphaMode", from.alphaMode, "there is no such alpha mode"};
    }
    material.double_sided = from.doubleSided;

    const auto& emissive = from.emissiveTexture;
    const bool has_base = base.texture >= 0;
    tinygltf::TextureInfo normal;
    normal.index = from.normalTexture.index;
    normal.texCoord = from.normalTexture.texCoord;
    normal.extensions = from.normalTexture.extensions;
    const tinygltf::TextureInfo pane = transmission_texture(from);
    const bool first_is_normal = !has_base && emissive.index < 0 && normal.index >= 0,
               first_is_pane = !has_base && emissive.index < 0 && normal.index < 0;
    const UvPlacement uv = has_base ? base.uv
                                    : placement_of(first_is_normal ? normal
                                                   : first_is_pane ? pane
                                                                   : emissive);
    import.uv_of_material.push_back(uv);
    if (has_base) {
        if (auto error = import_texture(import, base.texture, material.base_color_image, &material)) return *error;
    }
    if (emissive.index >= 0) {
        if (auto error =
                import_texture(import, emissive.index, material.emissive_image, has_base ? nullptr : &material))
            return *error;
        if (has_base && uv != placement_of(emissive))
            import.warn("the emissive texture uses the base colour's texture coordinates; changes lux (" + where + ")");
    }
    if (normal.index >= 0) {
        if (auto error = import_texture(import, normal.index, material.normal_image,
                                        first_is_normal ? &material : nullptr, true))
            return *error;
        material.normal_scale = static_cast<float>(std::clamp(from.normalTexture.scale, -1e3, 1e3));
        if (uv != placement_of(normal))
            import.warn("the normal texture uses another texture's coordinates; changes lux (" + where + ")");
    }
    if (auto error = import_transmission(import, from, first_is_pane, where, material)) return *error;
    if (pane.index >= 0 && uv != placement_of(pane))
        import.warn("the transmission texture uses another texture's coordinates; changes lux (" + where + ")");
    if (from.extensions.count("KHR_materials_unlit")) {
        const bool emits = import.options.unlit == Unlit::emission;
        import.warn(feature_warning("KHR_materials_unlit", "",
                                    emits ? "the base colour is emitted, 80 cd/m² at white (--unlit emission)"
                                          : "the base colour is reflectance (--unlit albedo)"));
        make_unlit(material, import.options.unlit);
    }
    return material;
}

// Whether the material is a metal that may shine; one of roughness 1 is close to diffuse.
bool is_shining_metal(const tinygltf::Material& material) {
    const auto& core = material.pbrMetallicRoughness;
    const bool replaced = material.extensions.count("KHR_materials_unlit") > 0 ||
                          material.extensions.count("KHR_materials_pbrSpecularGlossiness") > 0;
    return !replaced && core.metallicFactor > 0.0 &&
           (core.roughnessFactor < 1.0 || core.metallicRoughnessTexture.index >= 0);
}

bool covers_all(const Image& image) {
    for (std::size_t i = 3; i < image.rgba.size(); i += 4) {
        if (image.rgba[i] != 255) return false;
    }
    return true;
}

}  // namespace

std::optional<Error> settle_blending(GltfImport& import) {
    SceneAsset& scene = import.scene;
    std::vector<bool> sheer(scene.materials.size());  // by vertex colours
    for (const Mesh& mesh : scene.meshes) {
        if (!scene.materials[mesh.material].alpha_blend) continue;
        for (const glm::u16vec4& color : mesh.colors) sheer[mesh.material] = sheer[mesh.material] || color.a != 65535;
    }
    for (std::size_t i = 0; i < scene.materials.size(); ++i) {
        Material& material = scene.materials[i];
        const bool textured = material.alpha_blend && material.base_color_image >= 0;
        if (material.base_color.a == 1.0f && !sheer[i] &&
            !(textured && !covers_all(scene.images[material.base_color_image])))
            material.alpha_blend = false;
    }
    return std::nullopt;
}

std::optional<Error> warn_of_materials(GltfImport& import) {
    const auto& materials = import.document.model->materials;
    std::vector<bool> shown(import.scene.materials.size());
    for (const Mesh& mesh : import.scene.meshes) shown[mesh.material] = true;
    const auto warn = [&](FeatureName feature, const auto& has) {
        for (std::size_t i = 0; i < materials.size(); ++i) {
            if (!shown[i] || !has(import.scene.materials[i], materials[i])) continue;
            import.warn(feature_warning(feature, "/materials/" + std::to_string(i)));
            return;
        }
    };
    warn("KHR_materials_transmission", [](const Material& is, const auto&) { return is.transmission > 0.0f; });
    warn("alpha BLEND", [](const Material& is, const auto&) { return is.alpha_blend; });
    warn("normal textures", [](const Material& is, const auto&) { return is.normal_image >= 0; });
    warn("metallic-roughness materials", [](const Material&, const auto& from) { return is_shining_metal(from); });
    return std::nullopt;
}

std::optional<Error> import_materials(GltfImport& import) {
    const auto& materials = import.document.model->materials;
    for (std::size_t i = 0; i < materials.size(); ++i) {
        auto material = convert(import, materials[i], "/materials/" + std::to_string(i));
        if (!material) return material.error();
        import.scene.materials.push_back(std::move(*material));
    }
    import.scene.materials.emplace_back().name = "default";  // the last: of primitives that name none
    import.uv_of_material.emplace_back();
    return std::nullopt;
}

}  // namespace gonio

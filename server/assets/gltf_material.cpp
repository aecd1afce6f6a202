// glTF materials, textures and images -> Material and Image.
#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <tuple>

#include "server/assets/assets.h"
#include "server/assets/gltf_import.h"

namespace gonio {
namespace {

using tinygltf::Value;

double number(const Value& object, const char* member, double fallback) {
    return object.Has(member) ? object.Get(member).GetNumberAsDouble() : fallback;
}

glm::vec2 pair(const Value& object, const char* member, const glm::vec2& fallback) {
    if (!object.Has(member)) return fallback;
    const Value& value = object.Get(member);
    return {static_cast<float>(value.Get(0).GetNumberAsDouble()), static_cast<float>(value.Get(1).GetNumberAsDouble())};
}

// KHR_texture_transform: uv' = T R S uv, rotation counter-clockwise about the texture's upper left corner.
UvPlacement placement(const tinygltf::TextureInfo& texture) {
    UvPlacement result;
    result.set = texture.texCoord;
    const auto found = texture.extensions.find("KHR_texture_transform");
    if (found == texture.extensions.end()) return result;
    const auto turn = static_cast<float>(number(found->second, "rotation", 0.0));
    const glm::vec2 scale = pair(found->second, "scale", glm::vec2(1.0f));
    const float c = std::cos(turn), s = std::sin(turn);
    // Columns of R S, with R = [c s; -s c] (the extension's column-major matrix, v pointing down).
    result.linear = glm::mat2(c * scale.x, -s * scale.x, s * scale.y, c * scale.y);
    result.offset = pair(found->second, "offset", glm::vec2(0.0f));
    result.set = static_cast<int>(number(found->second, "texCoord", result.set));
    return result;
}

Result<Image> load_image(const GltfImport& import, int index) {
    const GltfDocument& document = import.document;
    const auto& source = document.images[index];
    const std::string where = "/images/" + std::to_string(index);
    const std::size_t room = std::min(kMaxSceneTexels - import.texels, import.room / kBytesOfTexel);
    if (source.uri.empty()) {
        if (source.buffer_view < 0) return Error{"bad_gltf", where, "", "an image without uri and bufferView"};
        return decode_image(view_bytes(document, source.buffer_view), where + "/bufferView", room);
    }
    const auto bytes = read_uri(document.directory, source.uri, where + "/uri", kMaxSceneFileBytes, kMaxSceneFileBytes);
    if (!bytes) return bytes.error();
    auto image = decode_image(*bytes, where + "/uri", room);
    if (image) return image;
    Error error = image.error();
    if (error.value.empty()) error.value = shown_uri(source.uri);
    return error;
}

// image: becomes an index into scene.images, or -1 for a texture that names none. wrap_into: takes the sampler's modes.
// linear: of the image.
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
                return Error{"bad_gltf", place + member, std::to_string(mode), "there is no such wrap mode"};
            }
        }
    }
    if (texture.source < 0) {
        import.warn("a texture without a PNG or JPEG source was left out (/textures/" + std::to_string(texture_index) +
                    ")");
        return std::nullopt;
    }
    const auto [known, is_new] =
        import.images.emplace(std::pair(texture.source, linear), static_cast<int>(import.scene.images.size()));
    image = known->second;
    if (!is_new) return std::nullopt;
    auto loaded = load_image(import, texture.source);
    if (!loaded) return loaded.error();
    const std::size_t texels = loaded->rgba.size() / 4;
    import.texels += texels;
    loaded->linear = linear;
    import.scene.images.push_back(std::move(*loaded));
    return take_memory(import.room, texels, kBytesOfTexel, "/images");
}

Result<Material> convert(GltfImport& import, const tinygltf::Material& from, const std::string& where) {
    Material material;
    material.name = from.name;
    const auto& factor = from.pbrMetallicRoughness.baseColorFactor;
    for (int c = 0; c < 4; ++c) {
        if (factor[c] < 0.0 || factor[c] > 1.0)
            import.warn("a baseColorFactor outside 0..1 was clamped (" + where + ")");
        material.base_color[c] = static_cast<float>(std::clamp(factor[c], 0.0, 1.0));
    }
    const auto strength = from.extensions.find("KHR_materials_emissive_strength");
    const double nits = strength == from.extensions.end() ? 1.0 : number(strength->second, "emissiveStrength", 1.0);
    for (int c = 0; c < 3; ++c) {
        const double value = from.emissiveFactor[c] * nits;
        if (value < 0.0 || value > 1e12) {
            return Error{"bad_gltf", where + "/emissiveFactor", std::to_string(value),
                         "the emission must be between 0 and 1e12 cd/m²"};
        }
        material.emissive_nit[c] = static_cast<float>(value);
    }
    if (from.alphaMode == "MASK" || from.alphaMode == "BLEND") {
        material.alpha_mask = true;
        material.alpha_cutoff = static_cast<float>(from.alphaMode == "MASK" ? from.alphaCutoff : 0.5);
        if (from.alphaMode == "BLEND") import.warn("alpha blending is treated as a mask (" + where + ")");
    } else if (from.alphaMode != "OPAQUE") {
        return Error{"bad_gltf", where + "/alphaMode", from.alphaMode, "there is no such alpha mode"};
    }
    material.double_sided = from.doubleSided;

    const auto &base = from.pbrMetallicRoughness.baseColorTexture, &emissive = from.emissiveTexture;
    const bool has_base = base.index >= 0;
    tinygltf::TextureInfo normal;
    normal.index = from.normalTexture.index;
    normal.texCoord = from.normalTexture.texCoord;
    normal.extensions = from.normalTexture.extensions;
    const bool first_is_normal = !has_base && emissive.index < 0;
    const UvPlacement uv = placement(has_base ? base : first_is_normal ? normal : emissive);
    import.uv_of_material.push_back(uv);
    if (has_base) {
        if (auto error = import_texture(import, base.index, material.base_color_image, &material)) return *error;
    }
    if (emissive.index >= 0) {
        if (auto error =
                import_texture(import, emissive.index, material.emissive_image, has_base ? nullptr : &material))
            return *error;
        if (has_base && uv != placement(emissive))
            import.warn("the emissive texture uses the base colour's texture coordinates (" + where + ")");
    }
    if (normal.index >= 0) {
        if (auto error = import_texture(import, normal.index, material.normal_image,
                                        first_is_normal ? &material : nullptr, true))
            return *error;
        material.normal_scale = static_cast<float>(from.normalTexture.scale);
        if (uv != placement(normal))
            import.warn("the normal texture uses another texture's coordinates (" + where + ")");
    }
    return material;
}

}  // namespace

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

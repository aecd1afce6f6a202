// glTF materials, textures and images -> Material and Image.
#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <tuple>

#include "server/assets/assets.h"
#include "server/assets/gltf_import.h"
#include "server/assets/image_file.h"

namespace gonio {
namespace {

using tinygltf::Value;

double number(const Value& object, const char* member, double fallback) {
    return object.Has(member) && object.Get(member).IsNumber() ? object.Get(member).GetNumberAsDouble() : fallback;
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

bool same(const UvPlacement& a, const UvPlacement& b) {
    return a.set == b.set && a.linear == b.linear && a.offset == b.offset;
}

class MaterialImport {
public:
    explicit MaterialImport(GltfImport& import) : import_(import), model_(*import.document.model) {}

    Result<bool> run() {
        for (std::size_t i = 0; i < model_.materials.size(); ++i) {
            auto material = convert(model_.materials[i], "/materials/" + std::to_string(i));
            if (!material) return material.error();
            import_.scene.materials.push_back(std::move(*material));
        }
        import_.default_material = static_cast<int>(import_.scene.materials.size());
        import_.scene.materials.push_back({});
        import_.scene.materials.back().name = "default";
        import_.uv_of_material.push_back({});
        return true;
    }

private:
    Result<Material> convert(const tinygltf::Material& from, const std::string& where) {
        Material material;
        material.name = from.name;
        const auto& factor = from.pbrMetallicRoughness.baseColorFactor;
        for (std::size_t c = 0; c < 4; ++c) {
            if (factor[c] < 0.0 || factor[c] > 1.0) {
                import_.warn("a baseColorFactor outside 0..1 was clamped (" + where + ")");
            }
            material.base_color[static_cast<glm::length_t>(c)] = static_cast<float>(std::clamp(factor[c], 0.0, 1.0));
        }
        const auto strength = from.extensions.find("KHR_materials_emissive_strength");
        const double nits = strength == from.extensions.end() ? 1.0 : number(strength->second, "emissiveStrength", 1.0);
        for (std::size_t c = 0; c < 3; ++c) {
            const double value = from.emissiveFactor[c] * nits;
            if (value < 0.0 || value > 1e12) {
                return Error{"bad_gltf", where + "/emissiveFactor", std::to_string(value),
                             "the emission must be between 0 and 1e12 cd/m²"};
            }
            material.emissive_nit[static_cast<glm::length_t>(c)] = static_cast<float>(value);
        }
        if (from.alphaMode == "MASK" || from.alphaMode == "BLEND") {
            material.alpha_mask = true;
            material.alpha_cutoff = static_cast<float>(from.alphaMode == "MASK" ? from.alphaCutoff : 0.5);
            if (from.alphaMode == "BLEND") import_.warn("alpha blending is treated as a mask (" + where + ")");
        } else if (from.alphaMode != "OPAQUE") {
            return Error{"bad_gltf", where + "/alphaMode", from.alphaMode, "there is no such alpha mode"};
        }
        material.double_sided = from.doubleSided;

        const auto& base = from.pbrMetallicRoughness.baseColorTexture;
        const UvPlacement uv = placement(base.index >= 0 ? base : from.emissiveTexture);
        import_.uv_of_material.push_back(uv);
        if (base.index >= 0) {
            auto image = texture_image(base.index, &material);
            if (!image) return image.error();
            material.base_color_image = *image;
        }
        if (from.emissiveTexture.index >= 0) {
            auto image = texture_image(from.emissiveTexture.index, base.index >= 0 ? nullptr : &material);
            if (!image) return image.error();
            material.emissive_image = *image;
            if (base.index >= 0 && !same(uv, placement(from.emissiveTexture))) {
                import_.warn("the emissive texture uses the base colour's texture coordinates (" + where + ")");
            }
        }
        return material;
    }

    // Result: index into scene.images, or -1 for a texture that names no image. wrap_into: takes the sampler's modes.
    Result<int> texture_image(int texture_index, Material* wrap_into) {
        const tinygltf::Texture& texture = model_.textures[static_cast<std::size_t>(texture_index)];
        const std::string where = "/textures/" + std::to_string(texture_index);
        if (texture.sampler >= 0 && wrap_into) {
            const auto& sampler = model_.samplers[static_cast<std::size_t>(texture.sampler)];
            const std::string place = "/samplers/" + std::to_string(texture.sampler);
            for (const auto& [mode, repeat, member] : {std::tuple(sampler.wrapS, &wrap_into->repeat_s, "/wrapS"),
                                                       std::tuple(sampler.wrapT, &wrap_into->repeat_t, "/wrapT")}) {
                *repeat = mode != TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE;
                if (mode == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT) {
                    import_.warn("mirrored texture repetition is treated as repetition (" + place + ")");
                } else if (*repeat && mode != TINYGLTF_TEXTURE_WRAP_REPEAT) {
                    return Error{"bad_gltf", place + member, std::to_string(mode), "there is no such wrap mode"};
                }
            }
        }
        if (texture.source < 0) {
            import_.warn("a texture without a PNG or JPEG source was left out (" + where + ")");
            return -1;
        }
        const auto known = loaded_.find(texture.source);
        if (known != loaded_.end()) return known->second;
        auto image = load_image(texture.source);
        if (!image) return image.error();
        const std::size_t texels =
            static_cast<std::size_t>(image->width_px) * static_cast<std::size_t>(image->height_px);
        texels_ += texels;
        if (auto full = take_memory(import_.room, texels, kBytesOfTexel, "/images")) return *full;
        import_.scene.images.push_back(std::move(*image));
        return loaded_[texture.source] = static_cast<int>(import_.scene.images.size()) - 1;
    }

    Result<Image> load_image(int index) {
        const auto& source = import_.document.images[static_cast<std::size_t>(index)];
        const std::string where = "/images/" + std::to_string(index);
        const std::size_t room = std::min(kMaxSceneTexels - texels_, import_.room / kBytesOfTexel);
        if (source.uri.empty()) {
            if (source.buffer_view < 0) return Error{"bad_gltf", where, "", "an image without uri and bufferView"};
            return decode_image(view_bytes(import_.document, source.buffer_view), where + "/bufferView", room);
        }
        const auto bytes =
            read_uri(import_.document.directory, source.uri, where + "/uri", kMaxSceneFileBytes, kMaxSceneFileBytes);
        if (!bytes) return bytes.error();
        auto image = decode_image(*bytes, where + "/uri", room);
        if (image) return image;
        Error error = image.error();
        if (error.value.empty()) error.value = shown_uri(source.uri);
        return error;
    }

    GltfImport& import_;
    const tinygltf::Model& model_;
    std::map<int, int> loaded_;  // glTF image -> index into scene.images
    std::size_t texels_ = 0;
};

}  // namespace

Result<bool> import_materials(GltfImport& import) {
    return MaterialImport(import).run();
}

}  // namespace gonio

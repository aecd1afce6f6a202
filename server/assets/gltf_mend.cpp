#include "server/assets/gltf_mend.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

namespace gonio {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kMostTold = 400;  // of a file's faults; fewer are shown

// Beyond so many faults one that changes lux takes the place of the last.
void tell(std::vector<std::string>& warnings, std::string sentence) {
    if (warnings.size() < kMostTold)
        warnings.push_back(std::move(sentence));
    else if (sentence.find("changes lux") != std::string::npos)
        warnings.back() = std::move(sentence);
}

// JSON has one kind of number: 1.0 is an integer too (RFC 8259, 6). Those of 31 bits are all that glTF has.
void mend_integers(Json& value) {
    if (value.is_structured()) {
        for (Json& child : value) mend_integers(child);
    }
    if (!value.is_number_float()) return;
    const double number = value.get<double>();
    if (std::abs(number) > 2147483647.0 || number != std::trunc(number)) return;
    if (number < 0.0)
        value = static_cast<std::int64_t>(number);
    else if (!std::signbit(number))
        value = static_cast<std::uint64_t>(number);
}

// A version without its quotes, or without its minor number.
void mend_versions(Json& document) {
    if (!document.is_object() || !document.contains("asset") || !document["asset"].is_object()) return;
    for (const char* name : {"version", "minVersion"}) {
        const auto version = document["asset"].find(name);
        if (version == document["asset"].end()) continue;
        if (version->is_string() && version->get_ref<const std::string&>() == "2") *version = "2.0";
        if (!version->is_number()) continue;
        *version = version->is_number_integer() ? version->dump() + ".0" : version->dump();
    }
}

// Result: the member, nullptr where there is none, or no object.
Json* member_of(Json* value, const char* name) {
    if (value == nullptr || !value->is_object()) return nullptr;
    const auto found = value->find(name);
    return found == value->end() ? nullptr : &*found;
}

// Result: how many elements the document's list has.
std::size_t length_of(Json& document, const char* list) {
    const Json* const found = member_of(&document, list);
    return found != nullptr && found->is_array() ? found->size() : 0;
}

// Whether the value is an integer that names none of so many.
bool names_none(const Json& value, std::size_t count) {
    if (!value.is_number_integer()) return false;
    return !value.is_number_unsigned() || value.get<std::uint64_t>() >= count;
}

std::string place_of(const std::string& where, const Json& value) {
    return " (" + where + ": " + value.dump() + ")";
}

// A texture of a material as the document names it.
struct Use {
    const char *extension, *parent, *name;  // "": the material's own
    bool changes_lux;                       // of what Gonio reads
};
constexpr Use kUses[] = {{"", "pbrMetallicRoughness", "baseColorTexture", true},
                         {"", "pbrMetallicRoughness", "metallicRoughnessTexture", false},
                         {"", "", "emissiveTexture", true},
                         {"", "", "normalTexture", true},
                         {"", "", "occlusionTexture", false},
                         {"extensions", "KHR_materials_pbrSpecularGlossiness", "diffuseTexture", true},
                         {"extensions", "KHR_materials_transmission", "transmissionTexture", true}};

// Result: the textures that materials use. A material's texture that is not there is taken off it.
std::set<std::uint64_t> mend_materials(Json& document, std::vector<std::string>& warnings) {
    std::set<std::uint64_t> used;
    const std::size_t textures = length_of(document, "textures");
    for (std::size_t i = 0; i < length_of(document, "materials"); ++i) {
        for (const Use& use : kUses) {
            Json* holder = &document["materials"][i];
            std::string where = "/materials/" + std::to_string(i);
            for (const char* name : {use.extension, use.parent}) {
                if (*name == '\0') continue;
                holder = member_of(holder, name);
                where.append("/").append(name);
            }
            const Json* const index = member_of(member_of(holder, use.name), "index");
            if (index == nullptr) continue;
            if (names_none(*index, textures)) {
                tell(warnings, std::string("a material's texture that is not there was left out") +
                                   (use.changes_lux ? "; changes lux" : "") +
                                   place_of(where + "/" + use.name + "/index", *index));
                holder->erase(use.name);
            } else if (index->is_number_unsigned()) {
                used.insert(index->get<std::uint64_t>());
            }
        }
    }
    return used;
}

// Textures without their image or their sampler, and images without their bytes.
void mend_textures(Json& document, const std::set<std::uint64_t>& used, std::vector<std::string>& warnings) {
    const std::size_t images = length_of(document, "images"), samplers = length_of(document, "samplers");
    for (std::size_t i = 0; i < length_of(document, "textures"); ++i) {
        Json& texture = document["textures"][i];
        const std::string where = "/textures/" + std::to_string(i);
        const bool is_used = used.contains(i);
        Json* const webp = member_of(member_of(&texture, "extensions"), "EXT_texture_webp");
        for (Json* const holder : {&texture, webp}) {
            const Json* const source = member_of(holder, "source");
            if (source == nullptr || !names_none(*source, images)) continue;
            if (!is_used)
                tell(warnings,
                     "a texture that nothing uses has no image" +
                         place_of(where + (holder == webp ? "/extensions/EXT_texture_webp" : "") + "/source", *source));
            holder->erase("source");
        }
        const Json* const sampler = member_of(&texture, "sampler");
        if (sampler == nullptr || !names_none(*sampler, samplers)) continue;
        tell(warnings, std::string(is_used ? "a texture whose sampler is not there repeats; changes lux"
                                           : "a texture that nothing uses has no sampler") +
                           place_of(where + "/sampler", *sampler));
        texture.erase("sampler");
    }
    const std::size_t views = length_of(document, "bufferViews");
    for (std::size_t i = 0; i < length_of(document, "images"); ++i) {
        Json& image = document["images"][i];
        const Json* const view = member_of(&image, "bufferView");
        if (view != nullptr && names_none(*view, views)) image.erase("bufferView");  // told of where it is used
    }
}

}  // namespace

void mend_gltf(Json& document, std::vector<std::string>& warnings) {
    mend_integers(document);
    mend_versions(document);
    mend_textures(document, mend_materials(document, warnings), warnings);
}

}  // namespace gonio

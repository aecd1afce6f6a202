#include "server/assets/gltf_features.h"

#include <span>

#include "server/assets/assets.h"

namespace gonio {
namespace {

constexpr const char* kIntroduction = R"(# What is made of glTF

`goniod --print-gltf` prints this page, from the table that the importer itself goes by (`server/assets/gltf_features.h`). *Lux*: light
differs from what glTF says. Warnings of a load name the row, what was made of it, and where; those that matter to lux say `changes lux`.

`KHR_materials_transmission`, alpha BLEND, normal textures and metals are said once a file, with the first material that a mesh shows.
Every surface is diffuse. Warnings say so, as *metallic-roughness materials*, of metals alone: a metallicFactor over 0 beside a
roughnessFactor under 1 or a metallicRoughnessTexture.

An extension that is not here is ignored where it is optional, with a warning. Where a file requires it, it is refused, unless it is one
of materials by its name (`VENDOR_materials_thing`): then surfaces have their material of glTF's core. Whatever a file says of its size
is bounded before memory is taken.

One fault does not refuse a file. An image or a photometric file that cannot be read is left out, and its luminaire is there, dark. A
texture, sampler or image that is named and not there is none. Of values that are no numbers, normals and tangents are rebuilt, colours
are white and texture coordinates 0. Triangles whose positions are no numbers are left out. A Draco mesh may have four times the vertices
and triangles that its accessors say. Of each fault one warning says where it is. What lacks bytes that a mesh needs, a truncated file
and a `minVersion` above 2.0 are refused.

Scenes in survey coordinates are shifted towards the origin when they are loaded, and clients see and enter the file's own positions:
[operations.md](operations.md#limits).
)";

std::string_view word_of(FeatureState state) {
    switch (state) {
        case FeatureState::supported:
            return "supported";
        case FeatureState::approximated:
            return "approximated";
        case FeatureState::ignored:
            return "ignored";
        case FeatureState::refused:
            return "refused";
    }
    return "";
}

void print(std::string& text, std::string_view title, std::string_view column, bool code,
           std::span<const GltfFeature> rows) {
    const std::string_view mark = code ? "`" : "";
    text.append("\n## ").append(title).append("\n\n| ").append(column).append(
        " | state | lux | how |\n|---|---|---|---|\n");
    for (const GltfFeature& row : rows) {
        text.append("| ").append(mark).append(row.name).append(mark).append(" | ").append(word_of(row.state));
        text.append(row.changes_lux ? " | changes | " : " | | ").append(row.how).append(" |\n");
    }
}

}  // namespace

const GltfFeature* find_extension(std::string_view name) {
    const auto found = std::find_if(kGltfExtensions.begin(), kGltfExtensions.end(),
                                    [&](const GltfFeature& row) { return row.name == name; });
    return found == kGltfExtensions.end() ? nullptr : &*found;
}

bool is_of_materials(std::string_view name) {
    return name.find("_materials_") != std::string_view::npos;
}

std::string feature_warning(const GltfFeature& feature, std::string_view where, std::string_view how) {
    std::string sentence(feature.name);
    sentence.append(": ").append(how.empty() ? feature.how : how);
    if (feature.changes_lux) sentence += "; changes lux";
    if (!where.empty()) sentence.append(" (").append(where).append(")");
    return sentence;
}

std::string gltf_features_text() {
    std::string text = kIntroduction;
    print(text, "Core features", "feature", false, kGltfCore);
    print(text, "Extensions", "extension", true, kGltfExtensions);
    return text;
}

}  // namespace gonio

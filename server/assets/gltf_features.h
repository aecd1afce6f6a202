// The one table of what the importer makes of glTF: core features, then extensions. Which extensions a file may
// require, the warnings of a load and docs/gltf.md follow from it.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>

namespace gonio {

enum class FeatureState : std::uint8_t {
    supported,     // as glTF says
    approximated,  // `how` says what is made of it
    ignored,       // left out; a file may require it still
    refused,       // a file that has it, or that requires it, does not load
};

struct GltfFeature {
    std::string_view name;  // extensions have the name of their specification
    FeatureState state;
    bool changes_lux;  // light differs from what glTF says
    std::string_view how;
};

constexpr auto kSupported = FeatureState::supported, kApproximated = FeatureState::approximated,
               kIgnored = FeatureState::ignored, kRefused = FeatureState::refused;

// glTF 2.0, its sections in order.
inline constexpr auto kGltfCore = std::to_array<GltfFeature>({
    {".gltf and .glb", kSupported, false, "told apart by content; glTF 2 only"},
    {"URIs", kSupported, false, "data: and files in the glTF's own folder, however their accents are spelt"},
    {"scenes", kSupported, false, "the default one, else the first"},
    {"nodes", kSupported, false,
     "matrix or translation, rotation and scale, mirrored too; two parents or a cycle are refused"},
    {"root nodes that are children", kApproximated, false,
     "a node that a scene lists though it is a child is shown once"},
    {"accessors", kSupported, false,
     "every component type, normalised or not, sparse or not; counts and ranges are checked"},
    {"triangles, strips and fans", kSupported, false, "indexed or not"},
    {"points and lines", kIgnored, false, "they are left out"},
    {"missing normals", kSupported, false, "flat ones are made"},
    {"vertex colours", kSupported, false, "COLOR_0 multiplies the base colour"},
    {"texture coordinates", kSupported, false, "one set of each material, that of its base colour"},
    {"tangents", kSupported, false, "of normal textures; without them derived from texture coordinates"},
    {"morph targets", kSupported, false,
     "positions, normals and tangents, by the weights of the node, else of the mesh; others are left out"},
    {"skins", kSupported, false, "joints place the vertices, by any number of weights, at the rest pose"},
    {"animations", kIgnored, true, "nodes keep their rest pose"},
    {"cameras", kSupported, false, "perspective ones: place, aim and yfov; +Y is up in every picture"},
    {"orthographic cameras", kIgnored, false, "they are left out"},
    {"metallic-roughness materials", kApproximated, true,
     "surfaces are diffuse: the base colour is the reflectance, of metals too; at most --max-albedo"},
    {"emission", kSupported, false, "factor and texture, 1 is 1 cd/m²; surfaces emit light into the room"},
    {"normal textures", kApproximated, true,
     "direct light has their normals; light after bounces in the reference alone"},
    {"occlusion textures", kIgnored, false, "they are left out: light computes occlusion"},
    {"alpha MASK", kSupported, false, "for the camera and for rays"},
    {"alpha BLEND", kApproximated, true, "1 - alpha lets light pass, neither refracted nor reflected"},
    {"double-sided materials", kSupported, false, "single-sided ones emit from their front only"},
    {"back faces", kSupported, false,
     "of single-sided surfaces culled, or shown with --backfaces show; they block light"},
    {"images", kSupported, false,
     "PNG and JPEG, told apart by content; others are left out, and over 8192 x 8192 refused"},
    {"texture wrap modes", kSupported, false, "CLAMP_TO_EDGE, REPEAT and MIRRORED_REPEAT"},
    {"texture filters", kApproximated, false, "the renderer filters by its own rules"},
    {"directional lights", kSupported, false,
     "those of KHR_lights_punctual are a sun of so many lux; sharp shadows but in the reference"},
    {"extras", kIgnored, false, "they are left out, but the level of a light that Gonio wrote"},
});

// Of the Khronos registry. An extension that is not here is ignored where it is optional. Where it is required it is
// refused, but for other materials: is_of_materials().
inline constexpr auto kGltfExtensions = std::to_array<GltfFeature>({
    {"KHR_animation_pointer", kIgnored, true,
     "nodes and materials keep their rest values; visibility has that of its first key"},
    {"KHR_draco_mesh_compression", kSupported, false, "decoded by libdraco; bytes of accessors come before it"},
    {"KHR_lights_punctual", kSupported, false,
     "point and spot in cd, the inverse square without range; directional in lx"},
    {"KHR_materials_anisotropy", kApproximated, true, "surfaces are diffuse"},
    {"KHR_materials_clearcoat", kApproximated, true, "surfaces are diffuse, without a coat"},
    {"KHR_materials_diffuse_transmission", kApproximated, true, "surfaces let no light through"},
    {"KHR_materials_dispersion", kApproximated, true, "surfaces disperse no light"},
    {"KHR_materials_emissive_strength", kSupported, false, "the emission in cd/m²"},
    {"KHR_materials_ior", kApproximated, true, "surfaces are diffuse and refract no light"},
    {"KHR_materials_iridescence", kApproximated, true, "surfaces are diffuse, without a thin film"},
    {"KHR_materials_pbrSpecularGlossiness", kApproximated, true,
     "surfaces are diffuse: diffuseFactor and diffuseTexture are the reflectance"},
    {"KHR_materials_sheen", kApproximated, true, "surfaces are diffuse, without a sheen"},
    {"KHR_materials_specular", kApproximated, true, "surfaces are diffuse"},
    {"KHR_materials_transmission", kApproximated, true,
     "factor times colour lets light pass, neither refracted nor reflected"},
    {"KHR_materials_unlit", kApproximated, true,
     "the base colour is reflectance, with --unlit emission light of 80 cd/m² at white"},
    {"KHR_materials_variants", kApproximated, true, "every primitive has its default material"},
    {"KHR_materials_volume", kApproximated, true, "media absorb no light"},
    {"KHR_materials_volume_scatter", kApproximated, true, "media scatter no light"},
    {"KHR_mesh_quantization", kSupported, false, "every component type, normalised or not"},
    {"KHR_meshopt_compression", kRefused, false, "libmeshoptimizer 0.18 does not decode it"},
    {"KHR_node_hoverability", kIgnored, false, "behaviour is left out"},
    {"KHR_node_selectability", kIgnored, false, "behaviour is left out"},
    {"KHR_node_visibility", kSupported, false,
     "hidden are the meshes and lights of a node and of all below it; cameras stay"},
    {"KHR_texture_basisu", kApproximated, true, "the texture's PNG or JPEG is taken; without one it is left out"},
    {"KHR_texture_transform", kSupported, false, "of the base colour, else of the emission"},
    {"KHR_xmp_json_ld", kIgnored, false, "metadata are left out"},
    {"ADOBE_materials_clearcoat_specular", kApproximated, true, "surfaces are diffuse, without a coat"},
    {"ADOBE_materials_clearcoat_tint", kApproximated, true, "surfaces are diffuse, without a coat"},
    {"ADOBE_materials_thin_transparency", kApproximated, true, "surfaces let no light through"},
    {"AGI_articulations", kIgnored, true, "nodes keep their rest pose"},
    {"AGI_stk_metadata", kIgnored, false, "metadata are left out"},
    {"CESIUM_primitive_outline", kIgnored, false, "outlines are left out"},
    {"EXT_lights_area", kSupported, false,
     "rect and disk, cd/m² from the side of -Z, as luminous openings; --scale scales them, cd/m² stay"},
    {"EXT_lights_ies", kSupported, false, "the web of the file, multiplier and colour"},
    {"EXT_instance_features", kIgnored, false, "metadata are left out"},
    {"EXT_lights_image_based", kIgnored, true, "surroundings emit no light"},
    {"EXT_mesh_features", kIgnored, false, "metadata are left out"},
    {"EXT_mesh_gpu_instancing", kSupported, false, "TRANSLATION, ROTATION and SCALE; at most 2^20 instances"},
    {"EXT_mesh_manifold", kIgnored, false, "triangles are shown as they are"},
    {"EXT_meshopt_compression", kSupported, false, "every mode and filter, by libmeshoptimizer"},
    {"EXT_structural_metadata", kIgnored, false, "metadata are left out"},
    {"EXT_texture_avif", kApproximated, true, "the texture's PNG or JPEG is taken; without one it is left out"},
    {"EXT_texture_webp", kSupported, false, "still pictures; they come before PNG and JPEG"},
    {"FB_geometry_metadata", kIgnored, false, "metadata are left out"},
    {"FB_ngon_encoding", kIgnored, false, "triangles are shown as they are"},
    {"GODOT_single_root", kIgnored, false, "the root is a node like others"},
    {"GRIFFEL_bim_data", kIgnored, false, "metadata are left out"},
    {"MSFT_lod", kIgnored, false, "the finest level is shown"},
    {"MSFT_packing_normalRoughnessMetallic", kIgnored, false, "its textures are left out"},
    {"MSFT_packing_occlusionRoughnessMetallic", kIgnored, false, "its textures are left out"},
    {"MSFT_texture_dds", kApproximated, true, "the texture's PNG or JPEG is taken; without one it is left out"},
    {"NV_materials_mdl", kApproximated, true, "surfaces have their material of glTF's core"},
});

// A row of the tables above by its name; a name that they lack does not compile.
class FeatureName {
public:
    consteval FeatureName(const char* name) : row_(find(name)) {}  // NOLINT: a name stands for its row
    const GltfFeature& row() const { return *row_; }

private:
    static consteval const GltfFeature* find(std::string_view name) {
        for (const GltfFeature& row : kGltfCore) {
            if (row.name == name) return &row;
        }
        for (const GltfFeature& row : kGltfExtensions) {
            if (row.name == name) return &row;
        }
        throw std::invalid_argument("no such glTF feature");
    }
    const GltfFeature* row_;
};

// Result: the extension's row, or nullptr.
const GltfFeature* find_extension(std::string_view name);

// Result: whether an extension, known or not, is one of materials by its name (VENDOR_materials_thing). Without it a
// surface has its material of glTF's core, and its shape is the same.
bool is_of_materials(std::string_view name);

// "name: how; changes lux (where)", with what of it there is. how: in place of the row's.
std::string feature_warning(const GltfFeature& feature, std::string_view where = "", std::string_view how = "");
inline std::string feature_warning(FeatureName name, std::string_view where = "", std::string_view how = "") {
    return feature_warning(name.row(), where, how);
}

}  // namespace gonio

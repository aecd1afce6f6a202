// glTF 2.0 files (.gltf, .glb) -> SceneAsset.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <exception>
#include <new>
#include <vector>

#include "ies/core/srgb.h"
#include "protocol/text/shortened_text.h"
#include "server/assets/assets.h"
#include "server/assets/far_place.h"
#include "server/assets/gltf_document.h"
#include "server/assets/gltf_import.h"
#include "server/assets/scale.h"

namespace gonio {

constexpr const char* kChanges = "changes lux";

void GltfImport::warn(std::string sentence) {
    auto& warnings = scene.warnings;
    if (std::find(warnings.begin(), warnings.end(), sentence) != warnings.end()) return;
    if (warnings.size() + 1 < kMaxWarnings) {
        warnings.push_back(std::move(sentence));
        return;
    }
    if (warnings.size() < kMaxWarnings) warnings.emplace_back("more warnings were left out");
    if (sentence.find(kChanges) != std::string::npos && !warnings.back().ends_with(kChanges))
        warnings.back().append("; ").append(kChanges);
}

void GltfImport::warn_first(std::string sentence) {
    auto& warnings = scene.warnings;
    if (warnings.size() == kMaxWarnings) {
        // The last says that more were left out, and takes over whether the one before it changes lux.
        const bool changes = warnings[kMaxWarnings - 2].find(kChanges) != std::string::npos;
        warnings.erase(warnings.end() - 2);
        if (changes && !warnings.back().ends_with(kChanges)) warnings.back().append("; ").append(kChanges);
    }
    warnings.insert(warnings.begin(), std::move(sentence));
}

std::optional<Error> take_memory(std::size_t& room, std::size_t count, std::size_t bytes_each,
                                 const std::string& where) {
    if (count > room / bytes_each)
        return Error{"too_large", where, std::to_string(count),
                     "they would take " + std::to_string(count * bytes_each >> 20) + " MiB, of which " +
                         std::to_string(room >> 20) + " are left"};
    room -= count * bytes_each;
    return std::nullopt;
}

namespace {

// path: the scene's own file, in the directory. Those that are missing are left out, as the importer does.
std::shared_ptr<const AssetFiles> files_of(const std::filesystem::path& directory, const std::string& path,
                                           const std::vector<std::string>& uris) {
    std::vector<std::filesystem::path> files{std::filesystem::path(path).filename()};
    for (const std::string& uri : uris)
        if (const auto file = file_of_uri(directory, uri, "")) files.push_back(*file);
    return hashed_files(directory, files);
}

// Of what a material covers so much reflects; a clear pane reflects nothing.
float reflecting_share(const Material& material) {
    return material.transmission_image >= 0 ? 1.0f : 1.0f - material.transmission;
}

double rounded(double value) {
    return std::round(value * 1000.0) / 1000.0;
}

void bound_albedo(GltfImport& import, double most) {
    const auto white = static_cast<float>(most);
    // The greatest byte of a texel whose colour, times this factor, reflects no more than `most`.
    const auto brightest = [most](double factor) {
        const double linear = std::min(1.0, most / std::max(factor, 1e-6));
        return static_cast<std::uint8_t>(255.0 * srgb_of_linear(linear) + 1e-9);
    };
    const std::size_t count = import.scene.materials.size();
    std::vector<bool> used(count), uncolored(count), exceeding(count), seen(import.scene.images.size()),
        too_bright(import.scene.images.size());
    for (const Mesh& mesh : import.scene.meshes) {
        used[mesh.material] = true;
        if (mesh.colors.empty()) uncolored[mesh.material] = true;
    }
    std::vector<glm::dvec3> factors(import.scene.images.size(),
                                    glm::dvec3(0.0));  // the greatest that an image is times
    for (std::size_t i = 0; i < count; ++i) {
        const Material& material = import.scene.materials[i];
        if (!used[i] || material.base_color_image < 0) continue;
        glm::dvec3& factor = factors[material.base_color_image];
        factor = glm::max(factor, glm::dvec3(glm::vec3(material.base_color)));
    }
    std::vector<double> albedo(count, 0.0);  // the greatest of a material's channels, where it exceeds
    const auto exceeds_by = [&](std::size_t material, double value) {
        albedo[material] = std::max(albedo[material], value);
    };
    // A white factor is usual beside vertex colours: then these are bounded.
    for (Mesh& mesh : import.scene.meshes) {
        const Material& material = import.scene.materials[mesh.material];
        const float reflects = reflecting_share(material);
        if (uncolored[mesh.material] || material.base_color_image >= 0) continue;
        for (glm::u16vec4& color : mesh.colors) {
            for (int k = 0; k < 3; ++k) {
                const auto greatest = static_cast<std::uint16_t>(
                    std::min(65535.0f, 65535.0f * white / std::max(reflects * material.base_color[k], 1e-6f)));
                if (color[k] <= greatest) continue;
                exceeds_by(mesh.material, color[k] / 65535.0 * static_cast<double>(reflects * material.base_color[k]));
                color[k] = greatest, exceeding[mesh.material] = true;
            }
        }
    }
    std::vector<std::array<std::uint8_t, 3>> greatest_texel(import.scene.images.size());
    int bounded = 0;
    double least = 1e300, greatest = 0.0;  // of the albedos of those
    for (std::size_t i = 0; i < import.scene.materials.size(); ++i) {
        Material& material = import.scene.materials[i];
        if (!used[i]) continue;
        if (material.base_color.r == 0.0f && material.base_color.g == 0.0f && material.base_color.b == 0.0f) continue;
        bool exceeds = exceeding[i];
        if (material.base_color_image < 0 && uncolored[i]) {
            for (int k = 0; k < 3; ++k) {
                if (!(reflecting_share(material) * material.base_color[k] > white)) continue;
                exceeds = true;
                exceeds_by(i, static_cast<double>(reflecting_share(material) * material.base_color[k]));
                material.base_color[k] = white;
            }
        } else if (material.base_color_image >= 0) {  // vertex colours only darken
            const int image = material.base_color_image;
            if (!seen[image]) {
                std::vector<std::uint8_t>& rgba = import.scene.images[image].rgba;
                for (std::size_t k = 0; k < 3; ++k) {
                    const std::uint8_t bright = brightest(factors[image][static_cast<int>(k)]);
                    for (std::size_t p = k; p < rgba.size(); p += 4) {
                        if (rgba[p] <= bright) continue;
                        greatest_texel[image][k] = std::max(greatest_texel[image][k], rgba[p]);
                        rgba[p] = bright, too_bright[image] = true;
                    }
                }
                seen[image] = true;
            }
            exceeds = too_bright[image];
            for (std::size_t k = 0; k < 3; ++k)
                exceeds_by(i, linear_of_srgb(greatest_texel[image][k] / 255.0) *
                                  static_cast<double>(material.base_color[static_cast<int>(k)]));
        }
        if (!exceeds) continue;
        ++bounded;
        const double reached = std::max(albedo[i], most);
        least = std::min(least, reached), greatest = std::max(greatest, reached);
    }
    if (bounded == 0) return;
    const std::string low = print_number(rounded(least)), high = print_number(rounded(greatest));
    import.warn_first(
        "materials reflect more than --max-albedo and were bounded there: surfaces that lose no light never end a "
        "bounce; "
        "changes lux (" +
        std::to_string(bounded) + (bounded == 1 ? " material" : " materials") + ", albedo " +
        (low == high ? high : low + " to " + high) + ")");
}

// read: what opens the document, within the room. where, name: of the result. The rest as of load_scene.
template <typename Read>
Result<std::shared_ptr<SceneAsset>> load_gltf(const Read& read, const std::string& where, const std::string& name,
                                              const LoadOptions& options, std::size_t& room) {
    try {
        const Result<GltfDocument> document = read(room);
        if (!document) return document.error();
        auto scene = std::make_shared<SceneAsset>();
        scene->name = shortened_text(name, 4096);
        GltfImport import{*document, *scene, options, room};
        for (const std::string& warning : document->warnings) import.warn(warning);
        for (const auto step :
             {import_materials, import_meshes, settle_blending, warn_of_materials, import_nodes, warn_of_dark_lights}) {
            if (auto error = step(import)) return *error;
        }
        bound_albedo(import, options.max_albedo);
        if (scene->instances.empty()) import.warn("the scene has no triangles");
        room = import.room;
        if (!document->directory.empty()) scene->files = files_of(document->directory, where, document->uris);
        return scene;
    } catch (const std::bad_alloc&) {
        return Error{"too_large", where, "", "there is not enough memory for the scene"};
    } catch (const std::exception& error) {
        // The parts answer with Result; what is left is a fault of a third-party reader.
        return Error{"bad_gltf", where, error.what(), "the scene file could not be read"};
    }
}

Result<std::shared_ptr<SceneAsset>> load_file(const std::string& path, const std::string& name,
                                              const LoadOptions& options, std::size_t room) {
    return load_gltf([&](std::size_t& left) { return read_gltf_document(path, left); }, path, name, options, room);
}

std::shared_ptr<const SceneAsset> make_built_in(const std::string& name) {
    return name == "cornell" ? make_cornell() : name == "atrium" ? make_atrium() : make_cylinder();
}

}  // namespace

bool is_built_in(const std::string& name) {
    return name == "cornell" || name == "atrium" || name == "cylinder";
}

Result<std::shared_ptr<const SceneAsset>> load_scene(const std::string& name, const std::string& shown,
                                                     const LoadOptions& options, std::size_t most_bytes) {
    if (!(options.scale >= kLeastScale && options.scale <= kMostScale))
        return Error{"invalid_argument", "load_scene.scale", print_number(options.scale),
                     "must be a number from " + print_number(kLeastScale) + " to " + print_number(kMostScale)};
    const std::string& called = shown.empty() ? name : shown;
    const bool built_in = is_built_in(name);
    if (built_in && !options.show_backs && options.scale == 1.0) return make_built_in(name);
    Result<std::shared_ptr<SceneAsset>> scene =
        built_in ? std::make_shared<SceneAsset>(*make_built_in(name)) : load_file(name, called, options, most_bytes);
    if (!scene) {
        Error error = scene.error();
        if (error.where == name) error.where = called;
        return error;
    }
    scale_scene(**scene, options.scale);
    warn_of_extent(**scene);
    warn_of_coarse_vertices(**scene);
    bring_near(**scene);
    for (Material& material : (*scene)->materials) material.show_back = options.show_backs;
    return std::shared_ptr<const SceneAsset>(std::move(*scene));
}

Result<std::shared_ptr<const SceneAsset>> read_glb(std::span<const std::byte> bytes, const std::string& shown,
                                                   const LoadOptions& options, std::size_t& room) {
    auto scene =
        load_gltf([&](std::size_t& left) { return read_gltf_document(bytes, left); }, shown, shown, options, room);
    if (!scene) return scene.error();
    return std::shared_ptr<const SceneAsset>(std::move(*scene));
}

}  // namespace gonio

#include "server/exchange/import_mvr.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "ies/core/printed.h"
#include "protocol/schema/console.pb.h"
#include "protocol/text/shortened_text.h"
#include "server/assets/far_place.h"
#include "server/assets/gltf_import.h"
#include "server/assets/mesh_builder.h"
#include "server/assets/scale.h"
#include "server/base/bounded_file.h"
#include "server/exchange/import_parts.h"
#include "server/scene/limits.h"

namespace gonio::exchange {
namespace {

constexpr std::size_t kMostLines = GltfImport::kMaxWarnings;

std::vector<std::string> shortened(std::vector<std::string> lines) {
    if (lines.size() <= kMostLines) return lines;
    const std::size_t more = lines.size() - kMostLines + 1;
    lines.resize(kMostLines - 1);
    lines.push_back("and " + std::to_string(more) + " more lines");
    return lines;
}

// A transform of negative determinant turns triangles inside out; the copy has been turned beforehand.
int mirrored(SceneAsset& scene, Model::Part& part) {
    if (part.mirrored >= 0) return part.mirrored;
    Mesh copy = scene.meshes[static_cast<std::size_t>(part.mesh)];
    for (std::size_t i = 0; i + 2 < copy.indices.size(); i += 3) std::swap(copy.indices[i + 1], copy.indices[i + 2]);
    for (Vertex& vertex : copy.vertices) vertex.normal = -vertex.normal;
    for (glm::vec4& tangent : copy.tangents) tangent.w = -tangent.w;
    part.mirrored = static_cast<int>(scene.meshes.size());
    scene.meshes.push_back(std::move(copy));
    return part.mirrored;
}

std::optional<Error> show_model(ShowImport& import, Model& model, const mvr::ModelUse& use) {
    SceneAsset& scene = import.scene;
    for (Model::Part& part : model.parts) {
        const glm::dmat4 world = use.world_from_model * part.model_from_mesh;
        const std::string& name = import.show.objects[static_cast<std::size_t>(use.object)].name;
        if (!part.box) part.box = box_of(scene.meshes[static_cast<std::size_t>(part.mesh)]);
        if (!is_placed(world, *part.box)) {
            import.report.add(Outcome::left_out, "a model's place is too far or has no size", name);
            continue;
        }
        // Inside a model a mesh that its own node mirrors has been turned by the reader.
        const bool inside_out = glm::determinant(glm::dmat3(use.world_from_model)) < 0.0;
        if (inside_out && part.mirrored < 0) {
            const Mesh& mesh = scene.meshes[static_cast<std::size_t>(part.mesh)];
            if (auto full = take_memory(import.room, mesh.vertices.size(), kBytesOfVertex, name)) return full;
        }
        const int mesh = inside_out ? mirrored(scene, part) : part.mesh;
        const std::size_t count = scene.meshes[static_cast<std::size_t>(mesh)].indices.size() / 3;
        import.instanced += count;
        if (import.instanced > kMaxSceneTriangles || scene.instances.size() >= kMaxSceneInstances)
            return Error{"too_large", name, std::to_string(import.instanced),
                         "the show has too many triangles or models"};
        if (auto full = take_memory(import.room, count, kBytesOfTriangle, name)) return full;
        add_instance(scene, mesh, shortened_text(name, kMaxNameBytes), world);
    }
    return std::nullopt;
}

// From the corners of each instance's box; where there is none from the lights.
void set_bounds(SceneAsset& scene) {
    if (scene.instances.empty()) return measure_lights(scene);
    Bounds bounds;
    const auto reach = [&](const glm::dvec3& point) {
        bounds.min = glm::min(bounds.min, point);
        bounds.max = glm::max(bounds.max, point);
    };
    for (const Instance& instance : scene.instances) {
        const Bounds& box = scene.meshes[static_cast<std::size_t>(instance.mesh)].bounds;
        for (unsigned corner = 0; corner < 8; ++corner) {
            const glm::dvec3 at((corner & 1 ? box.max : box.min).x, (corner & 2 ? box.max : box.min).y,
                                (corner & 4 ? box.max : box.min).z);
            reach(glm::dvec3(instance.world_from_mesh * glm::dvec4(at, 1.0)));
        }
    }
    scene.bounds = bounds;
}

}  // namespace

std::optional<Error> import_models(ShowImport& import) {
    std::map<std::string, std::optional<Model>> models;  // nothing: it cannot be read
    for (const mvr::ModelUse& use : import.show.models) {
        const auto [at, fresh] = models.try_emplace(use.entry);
        if (fresh) {
            const auto bytes = import.archive.read(use.entry);
            auto model = bytes ? take_model(import, import.scene, *bytes, use.entry) : Result<Model>(bytes.error());
            if (model)
                at->second = std::move(*model);
            else
                import.report.add(Outcome::left_out, "a model cannot be read: " + model.error().code,
                                  named(use.entry, model.error()));
        }
        if (!at->second) continue;
        if (auto error = show_model(import, *at->second, use)) return error;
    }
    return std::nullopt;
}

Result<std::shared_ptr<SceneAsset>> import_mvr(std::string bytes, const std::string& shown, const LoadOptions& options,
                                               std::size_t room) {
    if (auto full = take_memory(room, bytes.size(), 2, shown)) return *full;
    const auto archive = open_zip(std::move(bytes), mvr::kMvrLimits);
    if (!archive) return archive.error();
    const auto show = mvr::read_mvr(*archive, {options.universe_offset});
    if (!show) return show.error();
    std::vector<std::string> names;
    for (const ZipEntry& entry : archive->entries())
        if (!entry.is_folder()) names.push_back(entry.name);
    const mvr::EntryIndex entries(names);
    auto scene = std::make_shared<SceneAsset>();
    scene->name = shortened_text(shown, 4096);
    ShowImport import{*archive, entries, *show, options, *scene, room};
    import.report.add(show->report);
    if (auto error = import_models(import)) return *error;
    if (auto error = import_fixtures(import)) return *error;
    import_groups(import);
    import.imported.universe_offset = options.universe_offset;
    scene->imported = std::make_shared<const Imported>(std::move(import.imported));
    if (scene->materials.empty()) add_material(*scene, "default", glm::vec3(0.5f));
    if (scene->instances.empty()) import.report.add(Outcome::defaulted, "the show has no models: nothing is lit");
    if (import.bodies && !import.bodies->parts.empty()) scene->bodies = std::move(import.bodies);
    set_bounds(*scene);
    if (import.patch.rows_size() > 0) scene->patch = std::make_shared<const v1::SetPatch>(std::move(import.patch));
    scene->notes = shortened(taken_lines(import.report));
    scene->warnings = shortened(report_lines(import.report));
    return scene;
}

Result<std::shared_ptr<const SceneAsset>> load_any_scene(const std::string& name, const std::string& shown,
                                                         const LoadOptions& options, std::size_t most_bytes) {
    std::string head(4, '\0');
    std::error_code failed;  // whoever opens a pipe may wait for ever
    if (!is_built_in(name) && std::filesystem::is_regular_file(name, failed))
        std::ifstream(name, std::ios::binary).read(head.data(), 4);
    if (!looks_like_zip(head)) return load_scene(name, shown, options, most_bytes);
    if (!(options.scale >= kLeastScale && options.scale <= kMostScale))
        return Error{"invalid_argument", "load_scene.scale", print_number(options.scale),
                     "must be a number from " + print_number(kLeastScale) + " to " + print_number(kMostScale)};
    if (std::abs(options.universe_offset) > kMostUniverseOffset)
        return Error{"invalid_argument", "load_scene.universe_offset", std::to_string(options.universe_offset),
                     printed("must be a whole number from %d to %d", -kMostUniverseOffset, kMostUniverseOffset)};
    auto bytes = read_bounded_file(name, mvr::kMvrLimits.archive_bytes);
    const std::string& called = shown.empty() ? name : shown;
    if (!bytes) return Error{"not_found", called, bytes.error().value, bytes.error().message};
    auto scene = import_mvr(std::move(*bytes), called, options, most_bytes);
    if (!scene) return scene.error();
    scale_scene(**scene, options.scale);
    warn_of_extent(**scene);
    // Not brought near: what lies too far has been left out, and shows that are merged keep one origin.
    warn_of_coarse_vertices(**scene);
    for (Material& material : (*scene)->materials) material.show_back = options.show_backs;
    const std::filesystem::path path = std::filesystem::absolute(name, failed);
    (*scene)->files = hashed_files(path.parent_path(), {path.filename()});
    return std::shared_ptr<const SceneAsset>(std::move(*scene));
}

}  // namespace gonio::exchange

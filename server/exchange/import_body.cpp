// Bodies of a show's fixtures: the models of a GDTF's geometries, and how they follow the fixture's lights.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "server/assets/gltf_import.h"
#include "server/assets/mesh_builder.h"
#include "server/exchange/axes.h"
#include "server/exchange/import_parts.h"
#include "server/exchange/mesh_3ds.h"
#include "server/scene/orientation.h"

namespace gonio::exchange {
namespace {

constexpr glm::vec3 kPrimitiveGrey(0.12f);  // black paint: a primitive has no colour

Result<Model> primitive_model(SceneAsset& shown, const std::string& primitive) {
    auto mesh = primitive_mesh(primitive);
    if (!mesh) return Error{"not_found", "PrimitiveType", primitive, "there is no such mesh"};
    Model model;
    model.parts.push_back({add_mesh(shown, std::move(*mesh), add_material(shown, primitive, kPrimitiveGrey))});
    return model;
}

// Brings a model to GDTF's axes and to its size there.
void fit(const SceneAsset& shown, const glm::dvec3& size_m, Model& model) {
    glm::dvec3 least(1e300), most(-1e300);
    for (Model::Part& part : model.parts) {
        part.model_from_mesh = z_up_from_y_up() * part.model_from_mesh;
        for (const Vertex& vertex : shown.meshes[static_cast<std::size_t>(part.mesh)].vertices) {
            const glm::dvec3 at(part.model_from_mesh * glm::dvec4(glm::dvec3(vertex.position), 1.0));
            least = glm::min(least, at), most = glm::max(most, at);
        }
    }
    const glm::dvec3 scale = model_scale(least, most, size_m, 1.0);
    for (Model::Part& part : model.parts)
        part.model_from_mesh =
            glm::dmat4(glm::dmat3(scale.x, 0, 0, 0, scale.y, 0, 0, 0, scale.z)) * part.model_from_mesh;
}

// What bodies cannot do: they emit nothing, and have no normal maps.
void make_plain(SceneAsset& shown, std::size_t first_material, std::size_t first_mesh) {
    for (std::size_t i = first_material; i < shown.materials.size(); ++i) {
        shown.materials[i].emissive_nit = glm::vec3(0.0f);
        shown.materials[i].emissive_image = shown.materials[i].normal_image = -1;
        shown.materials[i].show_back = true;
    }
    for (std::size_t i = first_mesh; i < shown.meshes.size(); ++i) shown.meshes[i].tangents.clear();
}

// Result: where a matrix puts something and how it turns it; its lengths and any mirroring left out.
glm::dmat4 rigid(const glm::dmat4& matrix) {
    glm::dmat4 result = glm::mat4_cast(turn_of(matrix));
    result[3] = matrix[3];
    return result;
}

// Where a mode's geometries are at home, rigid, of the fixture's axes.
std::vector<glm::dmat4> homes_of(const gdtf::Mode& mode) {
    std::vector<glm::dmat4> homes;
    for (const gdtf::Geometry& one : mode.geometries) {
        const glm::dmat4 here = one.parent >= 0 ? homes[static_cast<std::size_t>(one.parent)] * one.parent_from_geometry
                                                : one.parent_from_geometry;
        homes.push_back(rigid(here));
    }
    return homes;
}

bool starts_with(const std::vector<Turn>& turns, const std::vector<Turn>& first) {
    return turns.size() >= first.size() && std::equal(first.begin(), first.end(), turns.begin());
}

// The mount of one of a fixture's lights.
BodyMount mount_of(const SceneAsset& scene, const glm::dmat4& world_from_fixture, const BodyLight& light,
                   const std::vector<Turn>& turns, const std::vector<glm::dmat4>& homes) {
    BodyMount mount;
    mount.seed = static_cast<int>(light.seed);
    mount.world_from_fixture = rigid(world_from_fixture);
    const glm::dmat4& beam = homes[static_cast<std::size_t>(light.geometry)];
    mount.aim = -glm::normalize(glm::dvec3(beam[2]));
    for (const auto& [geometry, tilt] : turns) {
        const glm::dmat4& home = homes[static_cast<std::size_t>(geometry)];
        mount.joints.push_back({glm::dvec3(home[3]), glm::normalize(glm::dvec3(home[tilt ? 0 : 2]))});
    }
    const LightSeed& seed = scene.lights[light.seed];
    if (mount.joints.empty()) {  // it has turned with its light to a focus point
        glm::dmat4 about = glm::mat4_cast(seed.world_from_light * glm::inverse(light.home));
        about[3] = glm::dvec4(seed.position - glm::dvec3(about * glm::dvec4(seed.position, 0.0)), 1.0);
        mount.world_from_fixture = about * mount.world_from_fixture;
    } else if (light.axes) {
        const glm::dvec3 last = glm::dmat3(mount.world_from_fixture) * mount.joints.back().axis;
        mount.side = glm::dot(last, tilt_axis(seed, light.axes->pan_offset_rad)) < 0.0 ? -1.0 : 1.0;
    }
    return mount;
}

}  // namespace

const std::vector<std::vector<Turn>>& turns_of(ModeIndex& index, const gdtf::Mode& mode) {
    if (!index.turns.empty()) return index.turns;
    std::set<std::pair<int, bool>> turning;  // geometries, by tilt
    for (const gdtf::PatchedChannel& patched : mode.patched)
        for (const auto& function : mode.channels[static_cast<std::size_t>(patched.channel)].functions)
            if (function.attribute == "Pan" || function.attribute == "Tilt")
                turning.emplace(patched.geometry, function.attribute == "Tilt");
    for (std::size_t g = 0; g < mode.geometries.size(); ++g) {
        const int parent = mode.geometries[g].parent;
        std::vector<Turn> own = parent >= 0 ? index.turns[static_cast<std::size_t>(parent)] : std::vector<Turn>();
        for (const bool tilt : {false, true})
            if (own.size() < kMostJoints && turning.contains({static_cast<int>(g), tilt}))
                own.push_back({static_cast<int>(g), tilt});
        index.turns.push_back(std::move(own));
    }
    return index.turns;
}

void read_body_models(ShowImport& import, const ZipArchive& archive, const gdtf::FixtureType& type) {
    std::set<int> wanted;
    for (const gdtf::Mode& mode : type.modes)
        for (const gdtf::Geometry& geometry : mode.geometries)
            if (geometry.model >= 0) wanted.insert(geometry.model);
    if (wanted.empty()) return;
    if (!import.bodies) import.bodies = std::make_shared<Bodies>();
    SceneAsset& shown = import.bodies->shown;
    for (const int index : wanted) {
        const gdtf::Model& model = type.models[static_cast<std::size_t>(index)];
        const std::size_t materials = shown.materials.size(), meshes = shown.meshes.size();
        Result<Model> made(Error{"not_found", model.name, "", "it has neither a file nor a primitive"});
        if (!model.entry.empty()) {
            const auto bytes = archive.read(model.entry);
            const std::string entry = type.name + ": " + model.entry;
            made = bytes ? take_model(import, shown, *bytes, entry) : Result<Model>(bytes.error());
            if (!made)
                import.report.add(Outcome::left_out, "a fixture's model cannot be read: " + made.error().code,
                                  named(entry, made.error()));
        }
        if ((!made || made->parts.empty()) && !model.primitive.empty()) made = primitive_model(shown, model.primitive);
        if (!made || made->parts.empty()) {
            import.report.add(Outcome::left_out, "a model of a fixture is not drawn", type.name + ": " + model.name);
            continue;
        }
        make_plain(shown, materials, meshes);
        fit(shown, model.size_m, *made);
        import.models[&type].emplace(index, std::move(*made));
    }
}

void add_body(ShowImport& import, const FixtureBody& fixture, std::span<const BodyLight> lights) {
    const auto known = import.models.find(&fixture.type);
    if (known == import.models.end() || lights.empty()) return;
    const auto& turns = turns_of(index_of(import, fixture.mode), fixture.mode);
    const std::vector<glm::dmat4> homes = homes_of(fixture.mode);
    Bodies& bodies = *import.bodies;
    std::map<std::size_t, int> mounts;  // by seed
    for (std::size_t g = 0; g < fixture.mode.geometries.size(); ++g) {
        const auto model = known->second.find(fixture.mode.geometries[g].model);
        if (model == known->second.end()) continue;
        const auto follows = std::ranges::find_if(lights, [&](const BodyLight& light) {
            return starts_with(turns[static_cast<std::size_t>(light.geometry)], turns[g]);
        });
        const BodyLight& light = follows != lights.end() ? *follows : lights.front();
        const std::size_t joints = follows != lights.end() ? turns[g].size() : 0;
        const auto [at, fresh] = mounts.try_emplace(light.seed, static_cast<int>(bodies.mounts.size()));
        if (fresh) {
            bodies.mounts.push_back(mount_of(import.scene, fixture.world_from_fixture, light,
                                             turns[static_cast<std::size_t>(light.geometry)], homes));
            bodies.mounts.back().pan_rad = fixture.pan_rad;
        }
        for (const Model::Part& part : model->second.parts) {
            const Mesh& mesh = bodies.shown.meshes[static_cast<std::size_t>(part.mesh)];
            const glm::dmat4 fixture_from_mesh = homes[g] * part.model_from_mesh;
            const std::size_t triangles = mesh.indices.size() / 3;
            if (!is_placed(fixture_from_mesh, box_of(mesh))) {
                import.report.add(Outcome::left_out, "a part of a fixture is too far or has no size", fixture.name);
                continue;
            }
            if (bodies.parts.size() >= kMostBodyParts || import.body_triangles + triangles > kMostBodyTriangles ||
                take_memory(import.room, triangles, kBytesOfTriangle, fixture.name)) {
                import.report.add(Outcome::left_out, "a part of a fixture is beyond what is drawn of bodies",
                                  fixture.name);
                continue;
            }
            import.body_triangles += triangles;
            bodies.parts.push_back({at->second, joints});
            add_instance(bodies.shown, part.mesh, import.scene.lights[light.seed].name, fixture_from_mesh);
        }
    }
}

}  // namespace gonio::exchange

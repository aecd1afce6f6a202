// Random scenes under random commands. Every scene follows from one number, which a failure prints.
#include <algorithm>

#include "ies/synthetic.h"
#include "protocol/schema/command.pb.h"
#include "server/assets/assets.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "tests/scenes/dice.h"
#include "tests/stress/drive.h"

namespace gonio::stress {
namespace {

using test::Dice;

std::shared_ptr<const Profile> random_profile(Dice& dice) {
    const auto names = ies::synthetic_luminaires();
    switch (dice.upto(4)) {
        case 0:
            return test::isotropic(dice.magnitude(1e-3, 1e9));
        case 1:
            return test::cosine_power(dice.magnitude(1e-3, 1e9), dice.magnitude(0.5, 200.0));
        case 2:
            return punctual_spot_profile(dice.between(0.0, 0.5), dice.between(0.5, 1.5));
        default:
            return *builtin_profile(std::string(names[static_cast<std::size_t>(dice.upto(7))].name));
    }
}

Placed random_piece(Dice& dice, double size) {
    Placed piece;
    const int kind = dice.upto(3);
    if (kind == 0) {
        piece.mesh = test::inward_sphere(0.4 * size, 4 + dice.upto(12));
    } else if (kind == 1) {
        piece = box(glm::dvec3(-0.2 * size), glm::dvec3(0.2 * size), 0.5, dice.chance(0.5))[0];
    } else {
        const glm::dvec3 a = dice.within(size), b = dice.within(size), c = dice.within(size);
        piece.mesh = test::quad(a, b, c, a + c - b);
    }
    piece.material = matte(0.0);
    piece.material.base_color =
        glm::vec4(glm::vec3(dice.between(0, 1), dice.between(0, 1), dice.chance(0.2) ? 1.0 : dice.between(0, 1)), 1.0f);
    piece.material.double_sided = dice.chance(0.5);
    if (dice.chance(0.1)) piece.material.emissive_nit = glm::vec3(static_cast<float>(dice.magnitude(1e-2, 1e9)));
    piece.world_from_mesh = glm::mat4_cast(dice.turn());
    for (int k = 0; k < 3; ++k) {
        const double stretch = dice.chance(0.05) ? 0.0 : (dice.chance(0.2) ? -1.0 : 1.0) * dice.magnitude(0.05, 3.0);
        piece.world_from_mesh[k] *= stretch;
    }
    piece.world_from_mesh[3] = glm::dvec4(dice.within(size), 1.0);
    return piece;
}

glm::dvec3 random_position(Dice& dice, const Scene& scene, double size) {
    // Often on a vertex of the scene.
    if (dice.chance(0.3)) {
        const auto& instances = scene.asset->instances;
        const Instance& instance =
            instances[static_cast<std::size_t>(dice.upto(static_cast<int>(instances.size()) - 1))];
        const auto& vertices = scene.asset->meshes[static_cast<std::size_t>(instance.mesh)].vertices;
        const auto& vertex = vertices[static_cast<std::size_t>(dice.upto(static_cast<int>(vertices.size()) - 1))];
        return glm::dvec3(instance.world_from_mesh * glm::dvec4(vertex.position, 1.0));
    }
    return scene.asset->bounds.min * 0.5 + scene.asset->bounds.max * 0.5 + dice.within(size);
}

void put(google::protobuf::RepeatedField<double>* field, const glm::dvec3& v) {
    for (int k = 0; k < 3; ++k) field->Add(v[k]);
}

void random_command(Dice& dice, Scene& scene, double size) {
    v1::Command command;
    Loaded loaded;
    const std::string light =
        scene.lights[static_cast<std::size_t>(dice.upto(static_cast<int>(scene.lights.size()) - 1))].name;
    switch (dice.upto(9)) {
        case 0:
        case 1:
            command.mutable_set_light()->set_name(light);
            put(command.mutable_set_light()->mutable_position_m(), random_position(dice, scene, size));
            break;
        case 2:
            command.mutable_set_light()->set_name(light);
            command.mutable_set_light()->set_pan_rad(dice.between(-7, 7));
            command.mutable_set_light()->set_tilt_rad(dice.between(-7, 7));
            break;
        case 3:
            command.mutable_set_light()->set_name(light);
            command.mutable_set_light()->set_level_ratio(dice.chance(0.3) ? 0.0 : dice.between(0, 1));
            put(command.mutable_set_light()->mutable_color_rgb(), glm::dvec3(dice.magnitude(1e-3, 1e4), 1.0, 0.0));
            break;
        case 4:
            command.mutable_set_light()->set_name(light);
            loaded.profile = random_profile(dice);
            break;
        case 5:
            put(command.mutable_set_camera()->mutable_eye_m(), random_position(dice, scene, size));
            put(command.mutable_set_camera()->mutable_target_m(), random_position(dice, scene, size));
            command.mutable_set_camera()->set_fov_rad(dice.between(0.02, 3.0));
            break;
        case 6: {
            command.mutable_set_technique()->set_technique(technique_name(static_cast<Technique>(dice.upto(2))));
            command.mutable_set_technique()->set_samples(16u + static_cast<unsigned>(dice.upto(200)));
            break;
        }
        case 7:
            command.mutable_set_view()->set_view(view_name(static_cast<View>(dice.upto(9))));
            break;
        case 8:
            command.mutable_set_exposure()->set_ev100(dice.between(-10, 24));
            break;
        default:
            command.mutable_set_size()->set_width_px(16 + 2 * static_cast<unsigned>(dice.upto(20)));
            command.mutable_set_size()->set_height_px(16 + 2 * static_cast<unsigned>(dice.upto(20)));
    }
    apply(scene, command, loaded);  // a refusal (camera on its target) leaves the scene as it is
}

void one_scene(Bench& bench, std::uint64_t number) {
    Dice dice{std::mt19937_64(number)};
    const double size = dice.magnitude(0.01, 1000.0);
    std::vector<Placed> pieces;
    if (dice.chance(0.6)) pieces = box(glm::dvec3(-size), glm::dvec3(size), dice.between(0, 1), true);
    for (int i = dice.upto(8); i >= 0; --i) pieces.push_back(random_piece(dice, size));
    std::vector<LightSeed> lights;
    for (int i = dice.upto(7) * dice.upto(1); i >= 0; --i)
        lights.push_back(light_seed(random_profile(dice), dice.within(0.9 * size), dice.turn()));
    Scene scene = scene_of_pieces(std::move(pieces), std::move(lights));
    scene.samples = 256;
    for (int step = 0; step < 6; ++step) {
        bench.context = "scene " + std::to_string(number) + ", step " + std::to_string(step) + ", " +
                        technique_name(scene.technique) + ", " + view_name(scene.view);
        bench.renderer.begin_frame(scene, monotonic_ns());
        bench.renderer.finish_frame(true);
        if (step % 3 == 2) {
            bench.renderer.capture(scene, scene.view, 20, 18, false);
            values_of(bench, scene, scene.view, 12, 10);
            const Meter meter{random_position(dice, scene, size), glm::normalize(dice.within(1.0) + glm::dvec3(1e-3))};
            read_meter(bench, scene, meter, Renderer::MeterQuality::interactive);
            read_meter(bench, scene, meter, Renderer::MeterQuality::rsm);
        }
        random_command(dice, scene, size);
    }
}

}  // namespace

void fuzz(Bench& bench) {
    BufferWatch watch(bench, "fuzz");
    std::uint64_t number = bench.seed;
    do {
        one_scene(bench, number++);
    } while (std::chrono::steady_clock::now() < bench.until);
    bench.findings.of(bench.group, "values that are not finite", 0.0).profile = {
        {"scenes", static_cast<double>(number - bench.seed)}};
}

}  // namespace gonio::stress

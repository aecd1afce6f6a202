// Luminaires that turn and move: flux over cube seams, and no jumps in small steps.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "ies/photometry_file.h"
#include "ies/synthetic.h"
#include "ies/web.h"
#include "server/assets/assets.h"
#include "server/scene/scene.h"
#include "shaders/lib/as_cpp.h"
#include "tests/stress/drive.h"

namespace gonio::stress {
namespace {

using Quality = Renderer::MeterQuality;
using ies::kPi;

glm::dquat random_turn(std::mt19937_64& random) {
    // Shoemake 1992: uniform over all rotations.
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    const double u = uniform(random), a = 2 * kPi * uniform(random), b = 2 * kPi * uniform(random);
    return {std::sqrt(u) * std::cos(b), std::sqrt(1 - u) * std::sin(a), std::sqrt(1 - u) * std::cos(a),
            std::sqrt(u) * std::sin(b)};
}

// The 6 face centres, 12 edges (45 degrees) and 8 corners (35.26 degrees) of the cube as aims.
std::vector<glm::dquat> seam_turns() {
    std::vector<glm::dquat> turns;
    for (int x = -1; x <= 1; ++x) {
        for (int y = -1; y <= 1; ++y) {
            for (int z = -1; z <= 1; ++z) {
                if (x != 0 || y != 0 || z != 0) turns.push_back(orientation_aiming({x, y, z}));
            }
        }
    }
    return turns;
}

std::vector<std::shared_ptr<const Profile>> corpus() {
    std::vector<std::shared_ptr<const Profile>> profiles;
    const char* shared = std::getenv("GONIO_SHARED");
    if (shared == nullptr) return profiles;
    for (const char* folder : {"ies", "ldt"}) {
        const std::filesystem::path path = std::filesystem::path(shared) / "data/photometry" / folder;
        std::error_code missing;
        std::vector<std::filesystem::path> files;
        for (const auto& entry : std::filesystem::directory_iterator(path, missing)) files.push_back(entry.path());
        std::sort(files.begin(), files.end());
        for (const auto& file : files) {
            std::ifstream stream(file, std::ios::binary);
            const std::string bytes{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
            if (auto profile = make_profile(file.filename().string(), bytes)) profiles.push_back(*profile);
        }
    }
    return profiles;
}

// Flux in lm of the mask as it stands, and of the RSM of a white closed room around it.
struct FluxReader {
    double mask_lm = 0.0, rsm_lm = 0.0;
    void operator()(const Inspected& item) {
        const std::string_view name = item.name;
        if (name == "mask") {
            const auto n = static_cast<int>(std::lround(std::sqrt(static_cast<double>(item.values.size()) / 24.0)));
            mask_lm = 0.0;
            std::size_t at = 0;
            for (int face = 0; face < 6; ++face) {
                for (int j = 0; j < n; ++j) {
                    for (int i = 0; i < n; ++i, at += 4)
                        mask_lm += static_cast<double>(item.values[at]) * glsl64::cube_texel_solid_angle(i, j, n);
                }
            }
        }
        if (name == "flux") {
            double sum = 0.0;
            for (std::size_t i = 0; i < item.values.size(); i += 4) sum += static_cast<double>(item.values[i]);
            rsm_lm = sum * item.light->profile->peak_cd;
        }
    }
};

Mesh sphere(double radius, int rings) {
    return test::inward_sphere(radius, rings);
}

}  // namespace

void seams(Bench& bench) {
    FluxReader flux;
    BufferWatch watch(bench, "seams", [&](const Inspected& item) { flux(item); });
    Finding& mask = bench.findings.of(bench.group, "mask: flux error, built-in profiles", 0.005);
    Finding& rsm = bench.findings.of(bench.group, "rsm: flux error, built-in profiles", 0.005);
    Finding& corpus_mask = bench.findings.of(bench.group, "mask: flux error, corpus files", 0.005, !corpus().empty());
    std::mt19937_64 random(bench.seed);
    Placed room;
    room.mesh = sphere(3.0, 64);
    room.material = matte(1.0);
    Scene scene = scene_of_pieces({room}, {light_seed(test::isotropic(1.0), {0.3, 0.1, -0.2})});
    scene.width_px = scene.height_px = 16;
    renew(scene);
    // The mask and rsm-flux views need the light's maps only.
    const auto measure = [&](const std::shared_ptr<const Profile>& profile, const glm::dquat& turn, View view) {
        Light& light = scene.lights[0];
        light.profile = profile;
        light.world_from_light = turn;
        scene.view = view;
        light.profile_rev = light.aim_rev = scene.view_rev = ++scene.scene_rev;
        bench.context = profile->name;
        bench.renderer.begin_frame(scene, monotonic_ns());
        bench.renderer.finish_frame(true);
    };
    const auto where = [&](const glm::dquat& turn) {
        const glm::dvec3 aim = aim_of(turn);
        char text[96];
        std::snprintf(text, sizeof text, " aimed %.3f,%.3f,%.3f", aim.x, aim.y, aim.z);
        return bench.context + text;
    };
    std::vector<glm::dquat> turns = seam_turns();
    const std::size_t seam_count = turns.size();
    for (int i = 0; i < (bench.brief ? 2 : 24); ++i) turns.push_back(random_turn(random));
    for (const ies::SyntheticLuminaire& luminaire : ies::synthetic_luminaires()) {
        const auto profile = *builtin_profile(std::string(luminaire.name));
        for (std::size_t i = 0; i < turns.size(); ++i) {
            if (bench.brief && (i < seam_count ? i % 9 != 0 : i % 2 != 0)) continue;
            measure(profile, turns[i], View::rsm_flux);
            mask.note(std::abs(flux.mask_lm / profile->flux_lm - 1.0), [&] { return where(turns[i]); });
            rsm.note(std::abs(flux.rsm_lm / profile->flux_lm - 1.0), [&] { return where(turns[i]); });
        }
    }
    std::size_t file = 0;
    for (const auto& profile : corpus()) {
        if (profile->flux_lm <= 0.0 || (bench.brief && file++ % 16 != 0)) continue;
        const glm::dquat turn = random_turn(random);
        measure(profile, turn, View::mask);
        corpus_mask.note(std::abs(flux.mask_lm / profile->flux_lm - 1.0), [&] { return where(turn); });
    }
}

void steps(Bench& bench) {
    BufferWatch watch(bench, "steps");
    const auto excess = [&](const std::string& figure, double bound) -> Finding& {
        return bench.findings.of(bench.group, figure, bound);
    };
    // In a diffuse sphere the bounced light stays as it is, however the luminaire stands: every change is an error.
    Placed room;
    room.mesh = sphere(2.0, 128);
    room.material = matte(0.5);
    const auto profile = test::cosine_power(1000.0, 2.0);
    const double truth = 0.5 * profile->flux_lm / (4 * kPi * 4.0);
    const Meter points[] = {
        {{1.9996, 0, 0}, {-1, 0, 0}}, {{0, -1.9996, 0}, {0, 1, 0}}, {{-1.19976, 0, 1.59968}, {0.6, 0, -0.8}}};
    struct Motion {
        const char* name;
        glm::dvec3 step_m;
        double turn_rad;
    };
    const Motion motions[] = {{"1 degree", {}, kPi / 180},
                              {"1 mm", {1e-3, 0, 0}, 0.0},
                              {"3 mm", {0, 2e-3, 2.236e-3}, 0.0},
                              {"1 cm", {6e-3, 0, 8e-3}, 0.0}};
    const int count = bench.brief ? 2 : 24;
    for (const Motion& motion : motions) {
        if (bench.brief && &motion != &motions[0] && &motion != &motions[3]) continue;
        const std::string name = motion.name;
        Finding& dense = excess("sphere: rsm jump, steps of " + name, 0.005);
        Finding& links = excess("sphere: interactive jump, steps of " + name, 0.01);
        Scene scene = scene_of_pieces({room}, {light_seed(profile, {0.4, 0.3, 0.2})});
        scene.samples = kDefaultVpls;
        double before_dense[3] = {}, before_links[3] = {};
        for (int k = 0; k <= count; ++k) {
            Light& light = scene.lights[0];
            light.position = glm::dvec3(0.4, 0.3, 0.2) + motion.step_m * static_cast<double>(k);
            light.world_from_light = orientation_of({0.3, 0.8 + motion.turn_rad * k, 0.0});
            light.position_rev = light.aim_rev = ++scene.scene_rev;
            for (int p = 0; p < 3; ++p) {
                bench.context = "step " + std::to_string(k) + ", point " + std::to_string(p);
                const auto where = [&] { return bench.context; };
                const double d = read_meter(bench, scene, points[p], Quality::rsm).indirect_lx() / truth;
                const double l = read_meter(bench, scene, points[p], Quality::interactive, 1).indirect_lx() / truth;
                if (k > 0) {
                    dense.note(std::abs(d - before_dense[p]), where);
                    links.note(std::abs(l - before_links[p]), where);
                }
                before_dense[p] = d;
                before_links[p] = l;
            }
        }
    }
    // In a room with edges and shadows light changes smoothly with the luminaire: what departs from the trend of the
    // steps before is a jump. Points on walls, and close to an edge, where single points of a list would show.
    const Meter open_points[] = {{{-1.999, 1.0, 0.5}, {1, 0, 0}},
                                 {{0.0, 3.999, 0.9}, {0, -1, 0}},
                                 {{0.5, 2.5, -1.999}, {0, 0, 1}},
                                 {{-1.4, 0.001, 1.2}, {0, 1, 0}}};
    const Meter edge_points[] = {{{-1.95, 0.001, 0.3}, {0, 1, 0}}, {{0.4, 0.001, -1.97}, {0, 1, 0}}};
    const Scene cornell = scene_of(make_cornell());
    for (const Motion& motion : motions) {
        if (bench.brief && &motion != &motions[0] && &motion != &motions[3]) continue;
        const std::string name = motion.name;
        Finding& open = excess("cornell walls: jump off the trend, steps of " + name, 0.03);
        Finding& edge = excess("cornell, 3-5 cm from edges: likewise, steps of " + name, 0.15);
        Scene scene = cornell;
        renew(scene);
        scene.samples = kDefaultVpls;
        const glm::dvec3 home = scene.lights[0].position;
        const PanTiltRoll turn = angles_of(scene.lights[0].world_from_light);
        std::vector<double> last, before_last;
        for (int k = 0; k <= count; ++k) {
            Light& light = scene.lights[0];
            light.position = home + motion.step_m * static_cast<double>(k);
            light.world_from_light = orientation_of({turn.pan_rad, turn.tilt_rad + motion.turn_rad * k, turn.roll_rad});
            light.position_rev = light.aim_rev = ++scene.scene_rev;
            std::vector<double> now;
            for (const auto& points_of : {std::span<const Meter>(open_points), std::span<const Meter>(edge_points)}) {
                for (const Meter& meter : points_of) {
                    const std::size_t p = now.size();
                    bench.context = "step " + std::to_string(k) + ", point " + std::to_string(p);
                    now.push_back(read_meter(bench, scene, meter, Quality::interactive).indirect_lx());
                    if (k < 2) continue;
                    const double jump = std::abs(now[p] - 2.0 * last[p] + before_last[p]) / last[p];
                    (points_of.data() == open_points ? open : edge).note(jump, [&] { return bench.context; });
                }
            }
            before_last = std::move(last);
            last = std::move(now);
        }
    }
}

}  // namespace gonio::stress

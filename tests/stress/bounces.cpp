// Every bounce where it is hardest to sum: reflectances near 1, luminaires of very different power side by side, next
// to a surface, and surfaces that coincide. In a diffuse sphere E = rho Phi / (4 pi R² (1 - rho)) everywhere.
#include <algorithm>
#include <cmath>

#include "ies/web.h"
#include "server/scene/scene.h"
#include "tests/stress/drive.h"

namespace gonio::stress {
namespace {

using ies::kPi;

constexpr double kRadius = 2.0;

Placed ball(double rho, double scale) {
    static const Mesh mesh = test::inward_sphere(kRadius, 96);
    Placed piece;
    piece.mesh = mesh;
    piece.material = matte(rho);
    piece.world_from_mesh = glm::dmat4(scale);
    piece.world_from_mesh[3] = glm::dvec4(0, 0, 0, 1);
    return piece;
}

// The worst error of meters around the sphere.
void check(Bench& bench, const Scene& scene, double truth_lx, double radius, Finding& worst) {
    for (const glm::dvec3& along : {glm::dvec3{1, 0, 0}, {0, -1, 0}, {-0.6, 0.0, 0.8}, {0.577, -0.577, 0.577}}) {
        const glm::dvec3 d = glm::normalize(along);
        const auto reading = read_meter(bench, scene, {d * radius * 0.9995, -d}, Renderer::MeterQuality::interactive);
        worst.note(std::abs(reading.indirect_lx() / truth_lx - 1.0), [&] { return bench.context; });
    }
}

}  // namespace

void bounces(Bench& bench) {
    BufferWatch watch(bench, "bounces");
    const auto isotropic = [](double cd) { return test::isotropic(cd); };
    const auto truth = [](double rho, double lm, double radius) {
        return rho * lm / (4 * kPi * radius * radius * (1 - rho));
    };
    // What is left out when a solve ends grows with 1 / (1 - rho).
    for (const double rho : {0.2, 0.5, 0.8, 0.9, 0.95, 0.99}) {
        if (bench.brief && rho != 0.5 && rho != 0.99) continue;
        Finding& finding = bench.findings.of(bench.group, rho > 0.95 ? "rho 0.99: error" : "rho 0.2 to 0.95: error",
                                             rho > 0.95 ? 0.05 : 0.02);
        for (const double scale : {0.005, 1.0, 500.0}) {
            char text[64];
            std::snprintf(text, sizeof text, "rho %g, a sphere of %g m", rho, 2 * kRadius * scale);
            bench.context = text;
            const Scene scene =
                scene_of_pieces({ball(rho, scale)}, {light_seed(isotropic(100.0), glm::dvec3(0.5, 0.3, 0.4) * scale)});
            check(bench, scene, truth(rho, 400 * kPi, kRadius * scale), kRadius * scale, finding);
        }
    }
    {
        bench.context = "1e-3 cd beside 1e7 cd";
        Scene scene = scene_of_pieces({ball(0.5, 1.0)}, {light_seed(isotropic(1e-3), {0.5, 0.3, 0.4}),
                                                         light_seed(isotropic(1e7), {-0.5, 0.1, 0.2})});
        Finding& finding = bench.findings.of(bench.group, "luminaires of very different power: error", 0.02);
        check(bench, scene, truth(0.5, 4e7 * kPi, kRadius), kRadius, finding);
        scene.lights[1].level_ratio = 0.0;
        scene.lights[1].level_rev = ++scene.scene_rev;
        check(bench, scene, truth(0.5, 4e-3 * kPi, kRadius), kRadius, finding);
    }
    // Here and below half the light or all of it falls on a few of the 4,000 surfels, whose areas are known to a tenth.
    // Meters are elsewhere: 1 mm before the surface beside the luminaire they would not see the surface that it lights.
    for (const double gap_m : {0.1, 1e-2, 1e-3}) {
        if (bench.brief && gap_m != 1e-3) continue;
        char text[64];
        std::snprintf(text, sizeof text, "luminaire %g m from the surface", gap_m);
        bench.context = text;
        const Scene scene =
            scene_of_pieces({ball(0.5, 1.0)}, {light_seed(isotropic(100.0), {0.0, kRadius - gap_m, 0.0})});
        check(bench, scene, truth(0.5, 400 * kPi, kRadius), kRadius,
              bench.findings.of(bench.group, "near a surface: error", 0.1));
    }
    // A beam whose spot is smaller than surfels lie apart.
    {
        bench.context = "beam of half a degree";
        bench.renderer.set_links(transport::kMostLinks);  // with those for narrow beams
        const Scene scene = scene_of_pieces({ball(0.5, 1.0)}, {light_seed(test::cosine_power(1e5, 90000.0), {0, 0, 0},
                                                                          orientation_aiming({0.3, -1, 0.2}))});
        check(bench, scene, truth(0.5, scene.lights[0].profile->flux_lm, kRadius), kRadius,
              bench.findings.of(bench.group, "a spot smaller than surfels: error", 0.10));
        bench.renderer.set_links(kLinks);
    }
    {
        bench.context = "two spheres that coincide";
        const Scene scene =
            scene_of_pieces({ball(0.5, 1.0), ball(0.5, 1.0)}, {light_seed(isotropic(100.0), {0.5, 0.3, 0.4})});
        check(bench, scene, truth(0.5, 400 * kPi, kRadius), kRadius,
              bench.findings.of(bench.group, "surfaces that coincide: error", 0.05));
    }
}

}  // namespace gonio::stress

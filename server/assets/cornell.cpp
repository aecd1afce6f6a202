// The built-in scene "cornell": a 4 m room open to the front, two boxes and a sculpture on the lower one; 33,480
// triangles, as in the seed paper's smaller test case. Proportions and reflectances follow the Cornell box.
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>

#include "server/assets/assets.h"
#include "server/assets/mesh_builder.h"

namespace gonio {
namespace {

constexpr double kHalf = 2.0;    // m, half the room's width and depth
constexpr double kHeight = 4.0;  // m
constexpr double kBox = 1.2;     // m, side of the lower box, half the height of the tall one

// A rope with three lobes, turning as it runs along a trefoil knot: p(u) on a torus, its cross section over v.
glm::dvec3 knot(double u, double v) {
    constexpr double major = 0.40, minor = 0.19, rope = 0.115, lobes = 3.0, turns = 7.0;  // m, m, m
    const auto centre = [](double t) {
        const double r = major + minor * std::cos(3.0 * t);
        return glm::dvec3(r * std::cos(2.0 * t), r * std::sin(2.0 * t), minor * 1.1 * std::sin(3.0 * t));
    };
    const double t = u * kTau;
    const glm::dvec3 here = centre(t), along = glm::normalize(centre(t + 1e-5) - centre(t - 1e-5));
    // The direction away from the torus' core circle is periodic in u, so the frame closes without a seam.
    const glm::dvec3 core(major * std::cos(2.0 * t), major * std::sin(2.0 * t), 0.0);
    const glm::dvec3 out = glm::normalize(here - core - along * glm::dot(here - core, along));
    const glm::dvec3 side = glm::cross(out, along);
    const double turn = v * kTau;
    const double radius = rope * (1.0 + 0.22 * std::cos(lobes * turn + turns * t));
    return here + radius * (std::cos(turn) * out + std::sin(turn) * side);
}

// A box of kBox x height x kBox standing on the floor, without its bottom: 10 triangles.
glm::dmat4 standing(double x, double z, double turn_degrees) {
    return glm::rotate(glm::translate(glm::dmat4(1.0), {x, 0.0, z}), glm::radians(turn_degrees), {0.0, 1.0, 0.0});
}

}  // namespace

std::shared_ptr<const SceneAsset> make_cornell() {
    auto scene = std::make_shared<SceneAsset>();
    scene->name = "cornell";
    const int white = add_material(*scene, "white", {0.73f, 0.73f, 0.73f});
    const int red = add_material(*scene, "red", {0.63f, 0.06f, 0.05f});
    const int green = add_material(*scene, "green", {0.15f, 0.48f, 0.09f});
    const int bronze = add_material(*scene, "bronze", {0.72f, 0.52f, 0.26f});

    const glm::dvec3 lbb(-kHalf, 0, -kHalf), rbb(kHalf, 0, -kHalf), ltb(-kHalf, kHeight, -kHalf),
        rtb(kHalf, kHeight, -kHalf), lbf(-kHalf, 0, kHalf), rbf(kHalf, 0, kHalf), ltf(-kHalf, kHeight, kHalf),
        rtf(kHalf, kHeight, kHalf);
    Mesh shell;  // floor, ceiling, back wall
    add_quad(shell, lbf, rbf, rbb, lbb);
    add_quad(shell, ltb, rtb, rtf, ltf);
    add_quad(shell, lbb, rbb, rtb, ltb);
    add_instance(*scene, add_mesh(*scene, std::move(shell), white), "room");
    Mesh left, right;
    add_quad(left, lbf, lbb, ltb, ltf);
    add_quad(right, rbb, rbf, rtf, rtb);
    add_instance(*scene, add_mesh(*scene, std::move(left), red), "left wall");
    add_instance(*scene, add_mesh(*scene, std::move(right), green), "right wall");

    const double half = kBox / 2.0;
    Mesh low, tall;
    add_box(low, {-half, 0.0, -half}, {half, kBox, half}, kNoBottom);
    add_box(tall, {-half, 0.0, -half}, {half, 2.0 * kBox, half}, kNoBottom);
    const glm::dmat4 low_transform = standing(0.68, 0.4, -17.0);
    add_instance(*scene, add_mesh(*scene, std::move(low), white), "low block", low_transform);
    add_instance(*scene, add_mesh(*scene, std::move(tall), white), "tall block", standing(-0.75, -0.75, 19.0));

    Mesh sculpture;  // 348 x 48 cells, 33,408 triangles
    add_surface(sculpture, knot, 348, 48, true, true);
    measure(sculpture);
    const glm::dmat4 on_box = glm::translate(glm::dmat4(1.0), {0.0, kBox - sculpture.bounds.min.y, 0.0});
    add_instance(*scene, add_mesh(*scene, std::move(sculpture), bronze), "sculpture", low_transform * on_box);

    Mesh canopy;  // the luminaire's ceiling plate, 42 triangles
    add_lathe(canopy, {{0.0, kHeight - 0.06}, {0.14, kHeight - 0.06}, {0.14, kHeight}}, 14);
    add_instance(*scene, add_mesh(*scene, std::move(canopy), white), "canopy");

    add_luminaire(*scene, {0.0, kHeight - 0.12, 0.6});
    scene->cameras.push_back({{0.0, 2.0, 7.75}, {0.0, 2.0, 0.0}, 0.69});
    scene->exposure_ev100 = 4.6;
    measure(*scene);
    return scene;
}

}  // namespace gonio

// Light between surfaces that is known in closed form: sphere, furnace, parallel plates.
#include <cmath>

#include "ies/web.h"
#include "server/assets/assets.h"
#include "tests/accuracy/pieces.h"

namespace gonio::accuracy {
namespace {

using ies::kPi;

// Inside a diffuse sphere a bounce is uniform wherever the luminaire stands: rho Phi / (4 pi R²), and all bounces
// together 1 / (1 - rho) times that.
std::vector<Case> integrating_sphere() {
    constexpr double radius = 2.0, rho = 0.5;
    const auto profile = test::as_point(*builtin_profile("wall_washer"));
    const double one_bounce = rho * profile->flux_lm / (4 * kPi * radius * radius);
    std::vector<Case> list;
    for (const bool all : {false, true}) {
        Case c{all ? "integrating-sphere-all" : "integrating-sphere",
               all ? "the same with all bounces" : "one bounce in a diffuse sphere, reflectance 0.5, asymmetric beam",
               "lx",
               test::scene_with({{test::inward_sphere(radius, 128), glm::vec3(rho)}}, profile, {0.2, -1.0, 0.7},
                                orientation_of({-2.0, 1.2, 0.7})),
               {},
               Part::indirect,
               {}};
        int number = 1;
        for (const glm::dvec3& at : {glm::dvec3{1, 0, 0}, {0, -1, 0}, {-0.6, 0, 0.8}, {0.1, 0.2, -0.97}}) {
            const glm::dvec3 d = glm::normalize(at);
            // A little inside: the sphere's triangles lie up to 0.6 mm within it.
            c.figures.push_back(
                {std::to_string(number++), {{d * (radius - 0.002), -d}}, all ? one_bounce / (1 - rho) : one_bounce});
        }
        c.settings.bounces = all ? trace::kAllBounces : 1;
        c.settings.noise = 0.002;
        if (all) {
            c.limit = "rsm has one bounce: short by the factor 1 - rho";
            c.interactive_tolerance = 0.01;
        } else {
            c.rsm_tolerance = 0.005;
            c.interactive_tolerance = 0.01;
        }
        list.push_back(std::move(c));
    }
    return list;
}

// White furnace: a closed room whose surfaces all emit epsilon and reflect rho has the luminance epsilon / (1 - rho)
// everywhere, corners included, so E = pi epsilon / (1 - rho).
Case furnace(const char* id, double rho) {
    constexpr double emission_nit = 100.0;
    std::vector<test::Piece> pieces = room(3, 2, 2.5, static_cast<float>(rho));
    for (test::Piece& piece : pieces) piece.emissive_nit = glm::vec3(static_cast<float>(emission_nit));
    Case c{id,   "white furnace: closed room, every surface emits 100 cd/m² and reflects " + std::string(id + 8),
           "lx", unlit_scene(std::move(pieces)),
           {},   Part::total,
           {}};
    const double expected = kPi * emission_nit / (1 - rho);
    c.figures = {{"floor", {{cie(1.1, 0.6, 0), cie(0, 0, 1)}}, expected},
                 {"floor near a corner", {{cie(0.02, 0.03, 0), cie(0, 0, 1)}}, expected},
                 {"in the air, turned", {{cie(1.4, 1.1, 1.2), glm::normalize(cie(1, 2, -0.5))}}, expected}};
    c.settings.noise = 0.003;
    c.limit = "emissive surfaces light nothing in rsm";
    c.interactive_tolerance = 0.02;
    return c;
}

// Two parallel plates 1 m apart and 100 m wide, the lower one evenly lit with E: the upper one receives rho E at the
// first bounce; all bounces: rho E / (1 - rho²) above, rho² E / (1 - rho²) below.
std::vector<Case> plates() {
    constexpr double rho = 0.5, lux = 1000.0, half = 50.0, light_m = 0.95;
    const auto scene = [=] {
        return test::scene_with(
            {wall(cie(-half, -half, 0), cie(half, -half, 0), cie(half, half, 0), cie(-half, half, 0), rho),
             wall(cie(-half, -half, 1), cie(-half, half, 1), cie(half, half, 1), cie(half, -half, 1), rho)},
            even_light(lux, light_m, std::atan(half / light_m)), cie(0, 0, light_m));
    };
    const Sample above{cie(0.3, 0.2, 1), cie(0, 0, -1)}, under{cie(0.3, 0.2, 0), cie(0, 0, 1)};
    Case one{"plates",
             "two parallel plates, the lower one lit: one bounce to the upper one",
             "lx",
             scene(),
             {},
             Part::indirect,
             {{"upper", {above}, rho * lux}}};
    one.settings.bounces = 1;
    one.settings.noise = 0.002;
    one.rsm_tolerance = 0.01;
    one.interactive_tolerance = 0.02;
    Case all{"plates-all",
             "the same with all bounces",
             "lx",
             scene(),
             {},
             Part::indirect,
             {{"upper", {above}, rho * lux / (1 - rho * rho)}, {"lower", {under}, rho * rho * lux / (1 - rho * rho)}}};
    all.settings.noise = 0.001;
    all.limit = "rsm has one bounce";
    all.interactive_tolerance = 0.02;
    return {std::move(one), std::move(all)};
}

}  // namespace

std::vector<Case> room_cases() {
    std::vector<Case> list = integrating_sphere();
    list.push_back(furnace("furnace-0.5", 0.5));
    list.push_back(furnace("furnace-0.9", 0.9));
    for (Case& c : plates()) list.push_back(std::move(c));
    return list;
}

}  // namespace gonio::accuracy

// CIE 171:2006, section 5: cases 5.2, 5.3, 5.4, 5.6, 5.7 and 5.8. Coordinates in comments are the standard's, z up.
#include <cmath>
#include <cstdio>
#include <numbers>

#include "ies/web.h"
#include "server/scene/scene.h"
#include "tests/accuracy/closed_forms.h"
#include "tests/accuracy/pieces.h"

namespace gonio::accuracy {
namespace {

using ies::kPi;
const glm::dvec3 kUp = cie(0, 0, 1), kDown = cie(0, 0, -1), kAlongY = cie(0, 1, 0);

std::string text(const char* format, double value) {
    char buffer[64];
    std::snprintf(buffer, sizeof buffer, format, value);
    return buffer;
}

Figure point(std::string name, const glm::dvec3& position, const glm::dvec3& normal, double expected,
             double weight = 1.0) {
    return {std::move(name), {{position, normal, weight}}, expected};
}

// 5.2: a point source 3 m above a black floor.
Case point_source(const std::string& id, const std::string& title, std::shared_ptr<const Profile> profile,
                  double (*law)(double r2)) {
    Case c{id, title, "lx", test::floor_scene(4.0, 0.0f, std::move(profile), cie(0, 0, 3)), {}, Part::direct, {}};
    const glm::dvec2 points[] = {{0, 0},   {0.5, 0},   {1, 0}, {1.5, 0}, {0.5, 0.5},
                                 {1, 0.5}, {1.5, 0.5}, {1, 1}, {1.5, 1}, {1.5, 1.5}};
    char name = 'A';
    for (const glm::dvec2& p : points)
        c.figures.push_back(point(std::string(1, name++), cie(p.x, p.y, 0), kUp, law(glm::dot(p, p))));
    c.reference_tolerance = 0.002;
    c.rsm_tolerance = c.interactive_tolerance = 0.002;
    return c;
}

// 5.3: a panel of 1 m x 1 m and 1000 cd/m² in the middle of the ceiling of a black room. The ceiling has a hole where
// the panel is, so that nothing lies in its plane.
std::vector<test::Piece> room_of_53() {
    std::vector<test::Piece> pieces = room(4, 4, 3, 0.0f);
    pieces.erase(pieces.begin() + 1);
    const double edges[][4] = {{0, 4, 0, 1.5}, {0, 4, 2.5, 4}, {0, 1.5, 1.5, 2.5}, {2.5, 4, 1.5, 2.5}};
    for (const auto& [x0, x1, y0, y1] : edges)
        pieces.push_back(wall(cie(x0, y0, 3), cie(x0, y1, 3), cie(x1, y1, 3), cie(x1, y0, 3), 0.0f));
    return pieces;
}

std::vector<Figure> figures_of_53() {
    std::vector<Figure> figures;
    char name = 'A';
    for (int i = 0; i < 6; ++i, ++name) {
        const double z = 2.75 - 0.5 * i;
        figures.push_back(point(std::string(1, name), cie(2, 0, z), kAlongY, area_source_on_wall(1000.0, z)));
    }
    for (int i = 0; i < 8; ++i, ++name) {
        const double y = 0.25 + 0.5 * i;
        figures.push_back(point(std::string(1, name), cie(2, y, 0), kUp, area_source_on_floor(1000.0, y)));
    }
    return figures;
}

std::vector<Case> area_source() {
    const ies::Opening panel{ies::OpeningShape::rectangle, 1.0 * m, 1.0 * m, 0.0 * m};
    Case opening{"cie-5.3",
                 "area source: luminaire with a luminous opening of 1 m x 1 m, 1000 cd Lambertian",
                 "lx",
                 test::scene_with(room_of_53(), with_opening(*test::cosine_power(1000.0, 1.0), panel), cie(2, 2, 3)),
                 {},
                 Part::direct,
                 figures_of_53()};
    opening.settings.noise = 0.002;
    opening.rsm_tolerance = opening.interactive_tolerance = 0.005;
    std::vector<test::Piece> pieces = room_of_53();
    pieces.push_back(wall(cie(1.5, 1.5, 3), cie(1.5, 2.5, 3), cie(2.5, 2.5, 3), cie(2.5, 1.5, 3), 0.0f));
    pieces.back().emissive_nit = glm::vec3(1000.0f);
    Case emissive{"cie-5.3-emissive",
                  "area source: the panel as an emissive surface of 1000 cd/m²",
                  "lx",
                  unlit_scene(std::move(pieces)),
                  {},
                  Part::direct,
                  figures_of_53()};
    emissive.settings.noise = 0.002;
    emissive.limit = "emissive surfaces light nothing in rsm";
    emissive.interactive_tolerance = 0.02;
    return {std::move(opening), std::move(emissive)};
}

// 5.4: 10,000 lm isotropic in the middle of a black room 4 x 4 x 3 m: where the lumens land.
Case flux_conservation() {
    constexpr double flux = 10000.0;
    Case c{"cie-5.4", "conservation of flux: isotropic, 10,000 lm, black room 4 m x 4 m x 3 m",
           "lm",      test::scene_with(room(4, 4, 3, 0.0f), test::isotropic(flux / (4 * kPi)), cie(2, 2, 1.5)),
           {},        Part::direct,
           {}};
    Figure all{"all faces", {}, flux};
    for (const Face& face : room_faces(4, 4, 3)) {
        const bool level = face.normal.y != 0.0;
        const double share = level ? rectangle_solid_angle(4, 4, 1.5) : rectangle_solid_angle(4, 3, 2.0);
        Figure figure{face.name, quadrature(face.corner, face.u, face.v, face.normal, 8, face.area()),
                      flux * share / (4 * kPi)};
        all.samples.insert(all.samples.end(), figure.samples.begin(), figure.samples.end());
        c.figures.push_back(std::move(figure));
    }
    c.figures.push_back(std::move(all));
    c.settings.bounces = 0;  // 65,536 paths at each of 768 points would find that black walls send nothing
    c.reference_tolerance = 0.001;
    c.rsm_tolerance = c.interactive_tolerance = 0.001;
    return c;
}

// 5.6: light that a horizontal diffuse surface reflects to a black wall and a black ceiling. A luminaire that lights
// the surface evenly takes the place of the standard's sun.
struct Surface56 {
    const char* id;
    double side, light_m;
    double noise;
    std::optional<double> rsm_tolerance, interactive_tolerance;
    const char* limit;
};
constexpr double kEvenLux = 1000.0, kRho56 = 0.3;

Scene scene_of_56(const Surface56& s) {
    const double low = 2 - s.side / 2, high = 2 + s.side / 2;
    // Wide enough for the corners, and not into the horizon.
    const double edge = std::atan(s.side * std::numbers::sqrt2 / 2 / s.light_m) + 0.005;
    std::vector<test::Piece> pieces = {
        wall(cie(low, low, 0), cie(high, low, 0), cie(high, high, 0), cie(low, high, 0), kRho56)};
    // The wall y = 0 hides what lies beyond it from the ceiling; the standard's largest surface is seen whole.
    if (low >= 0.0) pieces.push_back(wall(cie(0, 0, 0), cie(0, 0, 3), cie(4, 0, 3), cie(4, 0, 0), 0.0f));
    return test::scene_with(std::move(pieces), even_light(kEvenLux, s.light_m, edge), cie(2, 2, s.light_m));
}

std::vector<Figure> figures_of_56(double side) {
    const double percent = 100.0 / (kEvenLux * kRho56);
    std::vector<Figure> figures;
    char name = 'A';
    for (int i = 0; i < 6; ++i, ++name) {
        const double z = 0.25 + 0.5 * i;
        figures.push_back(
            point(std::string(1, name), cie(2, 0, z), kAlongY, 100 * reflection_on_wall(side, z), percent));
    }
    for (int i = 0; i < 8; ++i, ++name) {
        const double y = 0.25 + 0.5 * i;
        figures.push_back(
            point(std::string(1, name), cie(2, y, 3), kDown, 100 * reflection_on_ceiling(side, y), percent));
    }
    return figures;
}

std::vector<Case> diffuse_reflection() {
    std::vector<Case> list;
    for (const Surface56& s :
         {Surface56{"0.5", 0.5, 2.0, 0.002, 0.01, 0.01, ""}, Surface56{"4", 4.0, 4.0, 0.0002, 0.01, 0.02, ""},
          Surface56{"500", 500.0, 10.0, 0.001, {}, {}, "few texels of the map are as small as the room"}}) {
        const std::string size = std::string(s.id) + " m x " + s.id + " m";
        Case lit{std::string("cie-5.6-") + s.id + "-lit",
                 "the light of 5.6: illuminance of the surface of " + size + " is even",
                 "lx",
                 scene_of_56(s),
                 {},
                 Part::direct,
                 {}};
        const double half = s.side / 2;
        for (const glm::dvec2& at : {glm::dvec2{0, 0}, {0.3, 0.5}, {-0.99, 0.7}, {0.2, -0.9}, {0.99, 0.99}}) {
            const std::string name = text("(%.2f, ", at.x * half) + text("%.2f)", at.y * half);
            lit.figures.push_back(point(name, cie(2 + at.x * half, 2 + at.y * half, 0), kUp, kEvenLux));
        }
        lit.reference_tolerance = 0.005;
        lit.rsm_tolerance = lit.interactive_tolerance = 0.005;
        list.push_back(std::move(lit));
        Case c{std::string("cie-5.6-") + s.id,
               "diffuse reflection of a surface of " + size + ", E / (E_hz rho)",
               "%",
               scene_of_56(s),
               {},
               Part::indirect,
               figures_of_56(s.side)};
        c.settings.bounces = 1;
        c.settings.noise = s.noise;
        c.rsm_tolerance = s.rsm_tolerance;
        c.interactive_tolerance = s.interactive_tolerance;
        c.limit = s.limit;
        list.push_back(std::move(c));
    }
    return list;
}

// 5.7: the evenly lit wall y = 4 seen past a black box. The luminaire hangs between box and wall and lights nothing
// else.
constexpr double kRho57 = 0.6, kGap57 = 1.2;

Scene scene_of_57(bool with_box) {
    const double edge = std::atan(2.5 / kGap57) + 0.005;
    std::vector<test::Piece> pieces = {wall(cie(0, 4, 0), cie(4, 4, 0), cie(4, 4, 3), cie(0, 4, 3), kRho57),
                                       wall(cie(0, 0, 0), cie(0, 0, 3), cie(4, 0, 3), cie(4, 0, 0), 0.0f),
                                       wall(cie(0, 0, 0), cie(4, 0, 0), cie(4, 2.5, 0), cie(0, 2.5, 0), 0.0f)};
    if (with_box) {
        for (test::Piece& face : block({0, 2.5, 0}, {4, 2.7, 1}, 0.0f)) pieces.push_back(std::move(face));
    }
    return test::scene_with(std::move(pieces), even_light(kEvenLux, kGap57, edge), cie(2, 4 - kGap57, 1.5),
                            orientation_aiming(kAlongY));
}

Case seen_past(bool with_box) {
    Case c{with_box ? "cie-5.7" : "cie-5.7-open",
           with_box ? "diffuse reflection past an obstruction, E / (E_v rho)" : "the same without the obstruction",
           "%",
           scene_of_57(with_box),
           {},
           Part::indirect,
           {}};
    const double percent = 100.0 / (kEvenLux * kRho57);
    char name = 'A';
    for (int i = 0; i < 6; ++i, ++name) {
        const double z = 2.75 - 0.5 * i, factor = with_box ? obstructed_on_wall(z) : unobstructed_on_wall(z);
        c.figures.push_back(point(std::string(1, name), cie(2, 0, z), kAlongY, 100 * factor, percent));
    }
    for (int i = 0; i < 5; ++i, ++name) {
        const double y = 0.25 + 0.5 * i, factor = with_box ? obstructed_on_floor(y) : unobstructed_on_floor(y);
        c.figures.push_back(point(std::string(1, name), cie(2, y, 0), kUp, 100 * factor, percent));
    }
    c.settings.bounces = 1;
    c.settings.noise = 0.002;
    if (with_box) {
        c.limit = "the box does not hide the wall from the sum over all texels";
        c.interactive_tolerance = 0.02;
    } else {
        // The wall's edges fall within texels of the map that are 5 cm wide there: half of one is 1.3 % of the wall.
        c.rsm_tolerance = 0.015;
        c.interactive_tolerance = 0.01;
    }
    return c;
}

// 5.8: 10,000 lm isotropic in the middle of a cube of 4 m, all bounces: mean over all surfaces.
Case internal_reflection(double rho) {
    constexpr double flux = 10000.0, area = 96.0;
    Case c{"cie-5.8-" + text("%.2f", rho),
           "internal reflected component: cube of 4 m, 10,000 lm, reflectance " + text("%.2f", rho),
           "lx",
           test::scene_with(room(4, 4, 4, static_cast<float>(rho)), test::isotropic(flux / (4 * kPi)), cie(2, 2, 2)),
           {},
           Part::indirect,
           {}};
    Figure mean{"mean over all faces", {}, mean_indirect(flux, area, rho)};
    for (const Face& face : room_faces(4, 4, 4)) {
        const auto samples = quadrature(face.corner, face.u, face.v, face.normal, 6, 1.0 / 6.0);
        mean.samples.insert(mean.samples.end(), samples.begin(), samples.end());
    }
    // 3 % of the indirect part at each of 216 points; direct light is computed exactly.
    c.settings.noise = 0.03 * mean.expected / (mean.expected + flux / area);
    c.figures.push_back(std::move(mean));
    c.limit = "rsm has one bounce: short by the factor 1 - rho";
    if (rho <= 0.9) c.interactive_tolerance = 0.02;
    c.variant = rho != 0.1 && rho != 0.5 && rho != 0.9;
    return c;
}

}  // namespace

std::vector<Case> cie171_cases() {
    std::vector<Case> list;
    list.push_back(point_source("cie-5.2", "point source 3 m above the floor, 1000 cd Lambertian",
                                test::cosine_power(1000.0, 1.0),
                                [](double r2) { return 1000.0 * 9.0 / ((9.0 + r2) * (9.0 + r2)); }));
    list.push_back(point_source("cie-5.2-isotropic", "point source 3 m above the floor, 1000 cd in all directions",
                                test::isotropic(1000.0), [](double r2) { return 3000.0 / std::pow(9.0 + r2, 1.5); }));
    for (Case& c : area_source()) list.push_back(std::move(c));
    list.push_back(flux_conservation());
    for (Case& c : diffuse_reflection()) list.push_back(std::move(c));
    for (const bool with_box : {false, true}) list.push_back(seen_past(with_box));
    for (double rho : {0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95})
        list.push_back(internal_reflection(rho));
    return list;
}

}  // namespace gonio::accuracy

// Direct light of luminaires and emissive surfaces whose law is known.
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "ies/web.h"
#include "server/assets/assets.h"
#include "tests/accuracy/closed_forms.h"
#include "tests/accuracy/pieces.h"

namespace gonio::accuracy {
namespace {

using ies::kPi;
constexpr const char* kNoEmitters = "emissive surfaces light nothing in rsm";

Figure below(const std::string& name, double expected) {
    return {name, {{{0, 0, 0}, {0, 1, 0}}}, expected};
}

// A luminaire at the given height above a black floor, measured on the floor below it.
Case above_floor(const std::string& id, const std::string& title, std::shared_ptr<const Profile> profile,
                 double height_m, double expected) {
    Case c{id, title, "lx", test::floor_scene(4.0, 0.0f, std::move(profile), {0, height_m, 0}), {}, Part::direct, {}};
    c.figures.push_back(below("below", expected));
    return c;
}

std::vector<Case> hundred_lumens() {
    std::vector<Case> list = {above_floor("lambertian-100lm", "Lambertian point source of 100 lm at 1 m",
                                          test::cosine_power(100 / kPi, 1.0), 1.0, 100 / kPi),
                              above_floor("isotropic-100lm", "isotropic point source of 100 lm at 1 m",
                                          test::isotropic(100 / (4 * kPi)), 1.0, 100 / (4 * kPi))};
    for (Case& c : list) c.reference_tolerance = *(c.rsm_tolerance = c.interactive_tolerance = 0.001);
    return list;
}

test::Piece emissive_disc(double radius_m, double height_m, float luminance_nit) {
    constexpr int n = 256;
    Mesh mesh;
    mesh.vertices.push_back({{0, static_cast<float>(height_m), 0}, {0, -1, 0}, {0, 0}});
    for (int i = 0; i < n; ++i) {
        const double a = 2 * kPi * i / n;
        const glm::dvec3 p(radius_m * std::cos(a), height_m, radius_m * std::sin(a));
        mesh.vertices.push_back({glm::vec3(p), {0, -1, 0}, {0, 0}});
        const auto here = static_cast<std::uint32_t>(1 + i), next = static_cast<std::uint32_t>(1 + (i + 1) % n);
        for (std::uint32_t index : {0u, here, next}) mesh.indices.push_back(index);
    }
    return {std::move(mesh), glm::vec3(0.0f), glm::vec3(luminance_nit)};
}

test::Piece emissive_sphere(double radius_m, double height_m, float luminance_nit) {
    Mesh mesh = test::inward_sphere(radius_m, 96);
    for (Vertex& v : mesh.vertices) {
        v.position.y += static_cast<float>(height_m);
        v.normal = -v.normal;
    }
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) std::swap(mesh.indices[i + 1], mesh.indices[i + 2]);
    return {std::move(mesh), glm::vec3(0.0f), glm::vec3(luminance_nit)};
}

std::vector<Case> extended_sources() {
    constexpr double nit_value = 1000.0, r = 0.5, d = 1.0, ball = 0.2, ball_d = 0.5;
    const ies::Opening disc{ies::OpeningShape::ellipse, 2 * r * m, 2 * r * m, 0.0 * m};
    const ies::Opening sphere{ies::OpeningShape::ellipsoid, 2 * ball * m, 2 * ball * m, 2 * ball * m};
    const double on_axis = disc_on_axis(nit_value, r, d);
    const double from_sphere = kPi * nit_value * (ball / ball_d) * (ball / ball_d);  // E = pi L (R / d)²
    std::vector<Case> list = {
        above_floor("disc", "Lambertian disc of 1 m, 1000 cd/m², as a luminous opening, on its axis at 1 m",
                    with_opening(*test::cosine_power(nit_value * kPi * r * r, 1.0), disc), d, on_axis),
        above_floor("disc-emissive", "the same as an emissive surface", test::isotropic(0.0), d, on_axis),
        above_floor("sphere", "sphere of 0.4 m, 1000 cd/m², as a luminous opening, at 0.5 m",
                    with_opening(*test::isotropic(nit_value * kPi * ball * ball), sphere), ball_d, from_sphere),
        above_floor("sphere-emissive", "the same as an emissive surface", test::isotropic(0.0), ball_d, from_sphere)};
    const glm::dvec3 a(-2, 0, 2), b(2, 0, 2), c(2, 0, -2), e(-2, 0, -2);
    list[1].scene = unlit_scene({wall(a, b, c, e, 0.0f), emissive_disc(r, d, nit_value)});
    list[3].scene = unlit_scene({wall(a, b, c, e, 0.0f), emissive_sphere(ball, ball_d, nit_value)});
    for (std::size_t i = 0; i < list.size(); ++i) {
        list[i].settings.noise = 0.002;
        list[i].interactive_tolerance = i % 2 == 0 ? 0.005 : 0.01;
        if (i % 2 == 0)
            list[i].rsm_tolerance = 0.005;  // its direct light is the same
        else
            list[i].limit = kNoEmitters;
    }
    return list;
}

// E d² / I of a disc on its axis: the inverse square law holds to 1 % at five times the opening.
Case inverse_square() {
    constexpr double r = 0.05, candela = 1000.0;
    const ies::Opening disc{ies::OpeningShape::ellipse, 2 * r * m, 2 * r * m, 0.0 * m};
    Case c{"inverse-square",
           "E d² / I on the axis of a Lambertian disc at 5, 10 and 20 times its diameter",
           "1",
           test::scene_with({wall({-1, -9, 1}, {1, -9, 1}, {1, -9, -1}, {-1, -9, -1}, 0.0f)},
                            with_opening(*test::cosine_power(candela, 1.0), disc), {0, 0, 0}),
           {},
           Part::direct,
           {}};
    for (int times : {5, 10, 20}) {
        const double d = times * 2 * r;
        c.figures.push_back({std::to_string(times) + " diameters",
                             {{{0, -d, 0}, {0, 1, 0}, d * d / candela}},
                             1 / (1 + r * r / (d * d))});
    }
    c.settings.noise = 0.0003;
    c.reference_tolerance = 0.001;
    c.rsm_tolerance = c.interactive_tolerance = 0.001;
    return c;
}

// Cosine beam without symmetry, in the luminaire's frame (C0 = +X, C90 = +Y, zero = -Z).
double skew_law(const glm::dvec3& d) {
    return d.z < 0.0 ? 1000.0 * -d.z * (1.0 + 0.5 * d.y + 0.2 * d.x) : 0.0;
}

Figure seen_at(const std::string& name, const glm::dvec3& point, const glm::dvec3& normal, const glm::dvec3& light,
               const glm::dvec3& aim, const glm::dvec3& c0) {
    const glm::dvec3 d = glm::normalize(point - light), c90 = glm::cross(-aim, c0);
    const glm::dvec3 local(glm::dot(d, c0), glm::dot(d, c90), -glm::dot(d, aim));
    const double cosine = std::max(0.0, -glm::dot(d, normal));
    return {name, {{point, normal}}, skew_law(local) * cosine / glm::dot(point - light, point - light)};
}

// Points around a luminaire in the middle of a black cube of 4 m, six of which every turn lights some.
std::vector<Figure> figures_around(const glm::dvec3& aim, const glm::dvec3& c0) {
    std::vector<Figure> figures;
    const glm::dvec3 light = cie(2, 2, 2);
    for (const Face& face : room_faces(4, 4, 4)) {
        for (const auto& [s, t] : {std::pair{0.7, 0.35}, {0.2, 0.6}}) {
            const Figure figure =
                seen_at(face.name, face.corner + s * face.u + t * face.v, face.normal, light, aim, c0);
            if (figure.expected > 5.0) figures.push_back(figure);
        }
    }
    return figures;
}

std::shared_ptr<const Profile> skew_profile(ies::Goniometer goniometer) {
    auto profile = std::make_shared<Profile>();
    profile->name = "skew";
    ies::PhotometricWeb& web = profile->photometry.web;
    web.goniometer = goniometer;
    const bool c = goniometer == ies::Goniometer::type_c;
    for (int i = 0; i <= 360; ++i) web.v_rad.push_back((c ? i : i - 180) * kPi / 360);
    for (int i = 0; i <= (c ? 720 : 360); ++i) web.h_rad.push_back((c ? i : i - 180) * kPi / 360);
    for (double h : web.h_rad) {
        for (double v : web.v_rad) {
            const ies::Direction d = ies::direction_of(goniometer, Angle::radians(v), Angle::radians(h));
            web.candela.push_back(static_cast<float>(skew_law({d[0], d[1], d[2]})));
        }
    }
    profile->peak_cd = ies::peak_intensity(web).in(cd);
    profile->flux_lm = ies::total_flux(web).in(lm);
    return profile;
}

std::vector<Case> turned() {
    struct Turn {
        const char *id, *title;
        ies::Goniometer goniometer;
        glm::dvec3 aim, c0;
    };
    const auto type_c = ies::Goniometer::type_c, type_b = ies::Goniometer::type_b;
    std::vector<Case> list;
    for (const Turn& turn :
         {Turn{"turned-down-x", "asymmetric beam, aim -Y, C0 on +X", type_c, {0, -1, 0}, {1, 0, 0}},
          Turn{"turned-back-x", "asymmetric beam, aim -Z, C0 on +X", type_c, {0, 0, -1}, {1, 0, 0}},
          Turn{"turned-back-y", "asymmetric beam, aim -Z, C0 on +Y", type_c, {0, 0, -1}, {0, 1, 0}},
          Turn{"turned-left-y", "asymmetric beam, aim -X, C0 on +Y", type_c, {-1, 0, 0}, {0, 1, 0}},
          Turn{"type-b", "the same beam on a grid of Type B, aim -X, C0 on +Y", type_b, {-1, 0, 0}, {0, 1, 0}}}) {
        const glm::dmat3 axes(turn.c0, glm::cross(-turn.aim, turn.c0), -turn.aim);
        Case c{turn.id,
               turn.title,
               "lx",
               test::scene_with(room(4, 4, 4, 0.0f), skew_profile(turn.goniometer), cie(2, 2, 2),
                                glm::normalize(glm::quat_cast(axes))),
               {},
               Part::direct,
               figures_around(turn.aim, turn.c0)};
        c.reference_tolerance = 0.002;
        c.rsm_tolerance = c.interactive_tolerance = 0.003;
        c.variant = c.id == "turned-back-x" || c.id == "turned-left-y";
        list.push_back(std::move(c));
    }
    return list;
}

// A luminaire of 4 ft x 1 ft (length along C0), 1000 cd, as LM-63 text in feet and in metres. Multiplier 4 and ballast
// factor 0.5 scale its candela; the number after them, 1.25, means nothing in a file of 2002.
std::shared_ptr<const Profile> linear_lamp(bool feet) {
    std::string text =
        "IESNA:LM-63-2002\n[TEST] closed form\n[TESTLAB] none\n[ISSUEDATE] none\n[MANUFAC] none\nTILT=NONE\n"
        "1 -1 4 91 1 1 " +
        std::string(feet ? "1 1 4 0" : "2 0.3048 1.2192 0") + "\n0.5 1.25 0\n";
    for (int v = 0; v <= 90; ++v) text += std::to_string(v) + (v % 10 == 9 ? "\n" : " ");
    text += "\n0\n";
    for (int v = 0; v <= 90; ++v) {
        char number[32];
        std::snprintf(number, sizeof number, "%.5f%c", 500.0 * std::max(0.0, std::cos(v * kPi / 180)),
                      v % 10 == 9 ? '\n' : ' ');
        text += number;
    }
    auto profile = make_profile(feet ? "feet" : "metres", text + "\n");
    if (!profile) throw std::logic_error(profile.error().text());
    return *profile;
}

std::vector<Case> feet_and_metres() {
    constexpr double length = 1.2192, width = 0.3048, height = 1.0;
    std::vector<Case> list;
    for (const bool feet : {true, false}) {
        Case c{feet ? "feet" : "metres",
               feet ? "LM-63 file in feet: opening of 4 ft x 1 ft, 1000 cd Lambertian, 1 m above the floor"
                    : "the same file in metres",
               "lx",
               test::floor_scene(6.0, 0.0f, linear_lamp(feet), {0, height, 0}),
               {},
               Part::direct,
               {}};
        const double exitance = kPi * 1000.0 / (length * width);
        for (const glm::dvec2& p : {glm::dvec2{0, 0}, {0.8, 0}, {0, 0.8}}) {
            char name[32];
            std::snprintf(name, sizeof name, "(%g, 0, %g)", p.x, p.y);
            c.figures.push_back({name,
                                 {{{p.x, 0, p.y}, {0, 1, 0}}},
                                 exitance * parallel_factor(-length / 2 - p.x, length / 2 - p.x, -width / 2 - p.y,
                                                            width / 2 - p.y, height)});
        }
        c.settings.noise = 0.002;
        c.rsm_tolerance = c.interactive_tolerance = 0.005;
        list.push_back(std::move(c));
    }
    return list;
}

}  // namespace

std::vector<Case> source_cases() {
    std::vector<Case> list = hundred_lumens();
    for (Case& c : turned()) list.push_back(std::move(c));
    for (Case& c : extended_sources()) list.push_back(std::move(c));
    list.push_back(inverse_square());
    for (Case& c : feet_and_metres()) list.push_back(std::move(c));
    return list;
}

}  // namespace gonio::accuracy

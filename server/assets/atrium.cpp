// The built-in scene "atrium": a court 24 m x 12 m x 10 m between two storeys of columns, lit by one pendant. Columns,
// arches and balusters are instances of a few meshes; at least 262,267 triangles counted per instance, the size of the
// seed paper's larger test case.
#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>

#include "server/assets/assets.h"
#include "server/assets/mesh_builder.h"

namespace gonio {
namespace {

// Metres. The court runs along X; the two colonnades stand at Z = +-kRow, the walls at +-kHalfDepth.
constexpr double kHalfLength = 12.0, kHalfDepth = 6.0, kHeight = 10.0;
constexpr double kRow = 3.6;
constexpr double kBay = 3.0;    // distance of the columns' axes
constexpr int kColumns = 8;     // per row and storey
constexpr double kShaft = 2.8;  // shaft of the lower columns, which stand on a base of kBase
constexpr double kBase = 0.35, kCapital = 0.45;
constexpr double kSpring = kBase + kShaft + kCapital;  // where the arches begin
constexpr double kGallery = 5.4;                       // floor of the upper storey
constexpr double kSlab = 0.3;                          // its thickness
constexpr double kUpperScale = 0.72;                   // of the upper columns
constexpr double kColumnRadius = 0.34;

struct Parts {
    int base, shaft, capital, plinth, bay, baluster;
};

// 20 flutes around a shaft with entasis: the radius shrinks upwards, the flutes run out at both ends.
glm::dvec3 shaft_surface(double u, double v) {
    const double taper = 1.0 - 0.14 * std::pow(v, 1.7);
    const double run_out = std::min(1.0, 12.0 * std::min(v, 1.0 - v));
    const double flute = 0.5 + 0.5 * std::cos(20.0 * kTau * u);
    const double radius = kColumnRadius * taper * (1.0 - 0.085 * run_out * flute * flute);
    return {radius * std::cos(kTau * u), kBase + kShaft * v, -radius * std::sin(kTau * u)};
}

// A bell with eight leaves that curl outwards, from the shaft's radius to the abacus.
glm::dvec3 capital_surface(double u, double v) {
    const double leaf = 0.5 + 0.5 * std::cos(8.0 * kTau * u);
    const double bell = 0.86 + 0.62 * v * v;
    const double curl = 0.16 * leaf * std::sin(std::numbers::pi * std::min(1.0, 1.35 * v));
    const double radius = kColumnRadius * (bell + curl);
    return {radius * std::cos(kTau * u), kBase + kShaft + 0.86 * kCapital * v, -radius * std::sin(kTau * u)};
}

glm::dvec3 baluster_surface(double u, double v) {
    const double radius = 0.045 + 0.05 * std::pow(std::sin(std::numbers::pi * std::pow(v, 0.62)), 2.0) +
                          0.012 * std::cos(6.0 * kTau * v) * (1.0 - v);
    return {radius * std::cos(kTau * u), 0.7 * v, -radius * std::sin(kTau * u)};
}

// One bay of arcade wall around the origin: from the springing to kGallery, a semicircular opening between the columns.
Mesh arcade_bay() {
    constexpr double radius = kBay / 2.0 - 0.28, half = 0.3;  // m; half the wall's thickness
    constexpr int steps = 32;
    Mesh mesh;
    const double top = kGallery - kSlab, edge = kBay / 2.0;
    const auto arch = [&](int i) {
        const double turn = std::numbers::pi * (1.0 - static_cast<double>(i) / steps);
        return glm::dvec2(radius * std::cos(turn), kSpring + radius * std::sin(turn));
    };
    const auto plate = [&](const glm::dvec2& a, const glm::dvec2& b, double top_a, double top_b) {
        for (const double side : {1.0, -1.0}) {
            const auto at = [&](double x, double y) { return glm::dvec3(side * x, y, side * half); };
            const glm::dvec2 p = side > 0.0 ? a : glm::dvec2(-b.x, b.y), q = side > 0.0 ? b : glm::dvec2(-a.x, a.y);
            add_quad(mesh, at(p.x, p.y), at(q.x, q.y), at(q.x, top_b), at(p.x, top_a), {0.5, 0.5});
        }
    };
    for (int i = 0; i < steps; ++i) {
        const glm::dvec2 a = arch(i), b = arch(i + 1);
        plate(a, b, top, top);
        add_quad(mesh, {a.x, a.y, -half}, {b.x, b.y, -half}, {b.x, b.y, half}, {a.x, a.y, half}, {0.1, 0.5});
    }
    plate({-edge, kSpring}, {-radius, kSpring}, top, top);
    plate({radius, kSpring}, {edge, kSpring}, top, top);
    for (const double side : {-1.0, 1.0}) {  // undersides that rest on the columns
        const double a = side < 0.0 ? -edge : radius, b = side < 0.0 ? -radius : edge;
        add_quad(mesh, {a, kSpring, -half}, {b, kSpring, -half}, {b, kSpring, half}, {a, kSpring, half}, {0.2, 0.5});
    }
    return mesh;
}

// A hanging cloth, 1.3 m wide and 2.5 m long, its folds deeper towards the lower hem; hung at y = 0, facing +Z.
glm::dvec3 drape_surface(double u, double v) {
    const double depth = 0.03 + 0.09 * (1.0 - v);
    const double fold = std::sin(5.0 * kTau * u + 0.8 * std::sin(kTau * v));
    const double hem = 0.10 * (1.0 - v) * std::sin(std::numbers::pi * u);
    return {(u - 0.5) * (1.3 - 0.12 * (1.0 - v)), -2.5 * (1.0 - v) - hem, depth * fold};
}

glm::dmat4 placed(double x, double y, double z, double scale = 1.0) {
    return glm::scale(glm::translate(glm::dmat4(1.0), {x, y, z}), glm::dvec3(scale));
}

// The rear colonnade faces the other way: turned half round, never mirrored.
glm::dmat4 of_side(int side) {
    return glm::rotate(glm::dmat4(1.0), side > 0 ? 0.0 : std::numbers::pi, glm::dvec3(0.0, 1.0, 0.0));
}

Parts make_parts(SceneAsset& scene, int stone) {
    Parts parts{};
    Mesh base, shaft, capital, plinth, baluster;
    add_box(base, {-0.5, 0.0, -0.5}, {0.5, 0.12, 0.5}, kNoBottom);
    add_lathe(base, {{0.48, 0.12}, {0.48, 0.2}, {0.42, 0.24}, {0.40, 0.28}, {0.44, 0.32}, {kColumnRadius, kBase}}, 40);
    add_surface(shaft, shaft_surface, 120, 18, true, false, {2.0, 2.8});
    add_surface(capital, capital_surface, 64, 10, true, false, {2.0, 0.5});
    add_box(capital, {-0.56, kSpring - 0.07, -0.4}, {0.56, kSpring, 0.4});
    add_box(plinth, {-0.075, 0.0, -0.075}, {0.075, 0.05, 0.075}, kNoBottom);
    add_surface(baluster, baluster_surface, 16, 20, true, false, {0.3, 0.7});
    parts.base = add_mesh(scene, std::move(base), stone);
    parts.shaft = add_mesh(scene, std::move(shaft), stone);
    parts.capital = add_mesh(scene, std::move(capital), stone);
    parts.plinth = add_mesh(scene, std::move(plinth), stone);
    parts.bay = add_mesh(scene, arcade_bay(), stone);
    parts.baluster = add_mesh(scene, std::move(baluster), stone);
    return parts;
}

void add_column(SceneAsset& scene, const Parts& parts, const glm::dmat4& transform, const std::string& name) {
    add_instance(scene, parts.base, name + " base", transform);
    add_instance(scene, parts.shaft, name + " shaft", transform);
    add_instance(scene, parts.capital, name + " capital", transform);
}

void add_colonnade(SceneAsset& scene, const Parts& parts, int side) {
    const std::string name = side > 0 ? "south" : "north";
    const glm::dmat4 turn = of_side(side);
    const auto column_x = [](int i) { return (i - (kColumns - 1) / 2.0) * kBay; };
    for (int i = 0; i < kColumns; ++i) {
        const std::string number = " " + std::to_string(i + 1);
        add_column(scene, parts, turn * placed(column_x(i), 0.0, kRow), name + " column" + number);
        add_column(scene, parts, turn * placed(column_x(i), kGallery, kRow, kUpperScale),
                   name + " upper column" + number);
        if (i + 1 == kColumns) continue;
        const double middle = column_x(i) + kBay / 2.0;
        add_instance(scene, parts.bay, name + " arch" + number, turn * placed(middle, 0.0, kRow));
        constexpr int balusters = 8;
        for (int k = 0; k < balusters; ++k) {
            const double x = middle + (k - (balusters - 1) / 2.0) * 0.29;
            const std::string which = number + "." + std::to_string(k + 1);
            add_instance(scene, parts.plinth, name + " plinth" + which, turn * placed(x, kGallery, kRow));
            add_instance(scene, parts.baluster, name + " baluster" + which, turn * placed(x, kGallery + 0.05, kRow));
        }
    }
}

// Walls, floors and beams that are there once.
void add_shell(SceneAsset& scene, int brick, int marble, int stone) {
    const double l = kHalfLength, d = kHalfDepth, h = kHeight;
    Mesh floor, walls, beams;
    add_quad(floor, {-l, 0, d}, {l, 0, d}, {l, 0, -d}, {-l, 0, -d}, {2.0 * l / 2.4, 2.0 * d / 2.4});
    add_quad(walls, {-l, 0, -d}, {l, 0, -d}, {l, h, -d}, {-l, h, -d}, {2.0 * l, h});
    add_quad(walls, {l, 0, d}, {-l, 0, d}, {-l, h, d}, {l, h, d}, {2.0 * l, h});
    add_quad(walls, {-l, 0, d}, {-l, 0, -d}, {-l, h, -d}, {-l, h, d}, {2.0 * d, h});
    add_quad(walls, {l, 0, -d}, {l, 0, d}, {l, h, d}, {l, h, -d}, {2.0 * d, h});
    const double upper = kGallery + kUpperScale * kSpring;  // top of the upper columns
    for (const double side : {-1.0, 1.0}) {
        const auto beam = [&](double z_in, double z_out, double y_low, double y_high, unsigned left_out) {
            const double a = side * z_in, b = side * z_out;
            add_box(beams, {-l, y_low, std::min(a, b)}, {l, y_high, std::max(a, b)}, left_out | kNoLeft | kNoRight,
                    0.5);
        };
        const unsigned to_wall = side > 0.0 ? kNoFront : kNoBack;
        beam(kRow - 0.45, d, kGallery - kSlab, kGallery, to_wall);            // gallery floor
        beam(kRow - 0.5, kRow - 0.3, kGallery - 0.12, kGallery + 0.02, 0);    // its moulding
        beam(kRow - 0.09, kRow + 0.09, kGallery + 0.75, kGallery + 0.85, 0);  // handrail
        beam(kRow - 0.3, kRow + 0.3, upper, upper + 0.55, 0);                 // architrave
        beam(kRow - 0.5, d, upper + 0.55, upper + 0.75, to_wall);             // roof with its edge
        beam(kRow - 0.6, kRow - 0.3, upper + 0.75, upper + 0.9, 0);           // cornice
    }
    for (const double side : {-1.0, 1.0}) {  // piers close the arcade against the end walls
        for (const double end : {-1.0, 1.0}) {
            const double a = end * (kBay * (kColumns - 1) / 2.0), b = end * l;
            const glm::dvec3 low(std::min(a, b), kSpring, side * kRow - 0.3),
                high(std::max(a, b), kGallery - kSlab, side * kRow + 0.3);
            add_box(beams, low, high, kNoTop, 0.5);
        }
    }
    add_instance(scene, add_mesh(scene, std::move(floor), marble), "floor");
    add_instance(scene, add_mesh(scene, std::move(walls), brick), "walls");
    add_instance(scene, add_mesh(scene, std::move(beams), stone), "beams");
}

void add_drapes(SceneAsset& scene, int cloth_image) {
    const std::array<std::pair<const char*, glm::vec3>, 3> colours = {{
        {"red cloth", {0.62f, 0.05f, 0.05f}},
        {"blue cloth", {0.06f, 0.13f, 0.55f}},
        {"gold cloth", {0.72f, 0.46f, 0.07f}},
    }};
    for (std::size_t c = 0; c < colours.size(); ++c) {
        const int material = add_material(scene, colours[c].first, colours[c].second, cloth_image);
        scene.materials.back().double_sided = true;
        Mesh mesh;
        add_surface(mesh, drape_surface, 60, 14, false, false, {1.0, 2.0});
        const int drape = add_mesh(scene, std::move(mesh), material);
        // Hung over the balustrade in every other bay, the colours taking turns on the two sides.
        for (const int side : {1, -1}) {
            const double x = (static_cast<double>(c) - 1.0) * 2.0 * kBay;
            const glm::dmat4 facing_court =
                glm::rotate(placed(x, kGallery + 0.82, kRow - 0.65), std::numbers::pi, glm::dvec3(0.0, 1.0, 0.0));
            add_instance(scene, drape, colours[c].first, of_side(side) * facing_court);
        }
    }
}

}  // namespace

std::shared_ptr<const SceneAsset> make_atrium() {
    auto scene = std::make_shared<SceneAsset>();
    scene->name = "atrium";
    scene->images = {brick_texture(512), marble_texture(512), plaster_texture(512), cloth_texture(512)};
    const int brick = add_material(*scene, "brick", glm::vec3(1.0f), 0);
    const int marble = add_material(*scene, "marble", glm::vec3(1.0f), 1);
    const int stone = add_material(*scene, "stone", glm::vec3(1.0f), 2);
    const Parts parts = make_parts(*scene, stone);
    add_shell(*scene, brick, marble, stone);
    add_colonnade(*scene, parts, 1);
    add_colonnade(*scene, parts, -1);
    add_drapes(*scene, 3);

    add_luminaire(*scene, {0.0, 7.0, 0.0}, 5.0);
    scene->cameras.push_back({{-11.2, 2.3, 1.2}, {4.0, 3.6, -0.6}, 1.05});
    scene->exposure_ev100 = 4.0;
    measure(*scene);
    return scene;
}

}  // namespace gonio

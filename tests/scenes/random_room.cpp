#include "tests/scenes/random_room.h"

#include <algorithm>
#include <iterator>

#include "server/assets/assets.h"
#include "server/scene/scene.h"
#include "tests/scenes/dice.h"
#include "tests/scenes/placed.h"
#include "tests/scenes/scenes.h"

namespace gonio::test {
namespace {

struct Maker {
    Dice dice;
    glm::dvec3 room;  // from the origin to here
    std::vector<Placed> pieces{};
    std::vector<LightSeed> lights{};
    // Where no luminaire can be: where they stand, and their size.
    std::vector<std::pair<glm::dmat4, glm::dvec3>> solids{};

    Material paint() {
        Material material = matte(dice.between(0.1, 0.95));
        if (dice.chance(0.3)) {
            for (int k = 0; k < 3; ++k) material.base_color[k] *= static_cast<float>(dice.between(0.3, 1.0));
        }
        return material;
    }
    void add(std::vector<Placed> faces, const Material& material, const glm::dmat4& place = glm::dmat4(1.0)) {
        for (Placed& face : faces) {
            face.material = material;
            face.world_from_mesh = place;
            pieces.push_back(std::move(face));
        }
    }
    void slab(const glm::dvec3& a, const glm::dvec3& b, const Material& material,
              const glm::dmat4& place = glm::dmat4(1.0)) {
        add(box(glm::min(a, b), glm::max(a, b), 0.5, false), material, place);
    }
    // Where something of this size stands on the floor, turned by a multiple of a right angle or not at all straight.
    glm::dmat4 place_for(const glm::dvec3& size) {
        const double turn =
            dice.chance(0.6) ? 0.5 * std::numbers::pi * dice.upto(3) : dice.between(0.0, 2.0 * std::numbers::pi);
        const double reach = 0.5 * std::hypot(size.x, size.z);
        glm::dmat4 place = glm::mat4_cast(glm::angleAxis(turn, glm::dvec3(0, 1, 0)));
        place[3] = glm::dvec4(dice.between(std::min(reach, 0.5 * room.x), std::max(room.x - reach, 0.5 * room.x)), 0.0,
                              dice.between(std::min(reach, 0.5 * room.z), std::max(room.z - reach, 0.5 * room.z)), 1.0);
        return place;
    }
    glm::dvec3 some_size(double least, double most) {
        glm::dvec3 size(dice.between(least, most), dice.between(least, most), dice.between(least, most));
        return glm::min(size, 0.8 * room);
    }

    // A cupboard of boards around `size`, centred on the origin's axis and standing on it. Its door leaves a slit.
    void cupboard(const glm::dvec3& size, double slit_m, const glm::dmat4& place) {
        const double t = dice.between(0.005, 0.03);  // of the boards
        const Material material = paint();
        const glm::dvec3 a(-0.5 * size.x, 0.0, -0.5 * size.z), b(0.5 * size.x, size.y, 0.5 * size.z);
        slab(a, {b.x, t, b.z}, material, place);
        slab({a.x, b.y - t, a.z}, b, material, place);
        slab({a.x, t, a.z}, {a.x + t, b.y - t, b.z}, material, place);
        slab({b.x - t, t, a.z}, {b.x, b.y - t, b.z}, material, place);
        slab({a.x + t, t, a.z}, {b.x - t, b.y - t, a.z + t}, material, place);
        slab({a.x + t, t, b.z - t}, {std::max(a.x + 2.0 * t, b.x - t - slit_m), b.y - t, b.z}, material, place);
        for (int shelves = dice.upto(2), i = 1; i <= shelves; ++i) {
            const double y = size.y * i / (shelves + 1);
            slab({a.x + t, y, a.z + t}, {b.x - t, y + t, b.z - 2.0 * t}, material, place);
        }
    }
    // A niche: the same without a door.
    void niche(const glm::dvec3& size, const glm::dmat4& place) { cupboard(size, size.x, place); }
    void box_in_box() {
        const glm::dvec3 size = some_size(0.5, 2.0);
        const glm::dmat4 place = place_for(size);
        cupboard(size, dice.between(0.05, 0.4) * size.x, place);
        glm::dmat4 inside = place;
        inside[3] += place * glm::dvec4(0.0, 0.05 * size.y, 0.0, 0.0);
        cupboard(0.6 * size, dice.between(0.1, 0.5) * size.x, inside);
    }
    // A wall from side to side with a hole in it.
    void wall_with_hole() {
        const double x = dice.between(0.3, 0.7) * room.x, t = dice.between(0.02, 0.2);
        const bool keyhole = dice.chance(0.4);
        const double width = keyhole ? dice.between(0.02, 0.1) : dice.between(0.5, 1.2),
                     low = keyhole ? dice.between(0.5, 1.5) : 0.0,
                     high = std::min(0.95 * room.y, keyhole ? low + dice.between(0.02, 0.15) : dice.between(1.5, 2.2));
        const double z = dice.between(0.1, 0.8) * (room.z - width);
        const Material material = paint();
        // Its faces coincide with the room's, and what a ray from inside the wall meets there would be chance.
        const auto part = [&](const glm::dvec3& a, const glm::dvec3& b) {
            glm::dmat4 place(1.0);
            place[3] = glm::dvec4(0.5 * (a.x + b.x), a.y, 0.5 * (a.z + b.z), 1.0);
            solids.emplace_back(place, b - a);
            slab(a, b, material);
        };
        if (low > 0.0) part({x, 0.0, 0.0}, {x + t, low, room.z});
        part({x, high, 0.0}, {x + t, room.y, room.z});
        part({x, low, 0.0}, {x + t, high, z});
        part({x, low, z + width}, {x + t, high, room.z});
        if (!keyhole && dice.chance(0.3)) {  // a glass door
            Material glass = matte(0.5);
            if (dice.chance(0.5))
                glass.alpha_blend = true, glass.base_color.a = static_cast<float>(dice.between(0.1, 0.6));
            else
                glass.transmission = static_cast<float>(dice.between(0.5, 0.95));
            const double middle = x + 0.5 * t;
            add({{quad({middle, low, z}, {middle, low, z + width}, {middle, high, z + width}, {middle, high, z}), {}}},
                glass);
        }
    }
    // A thin double-sided sheet, upright, level or tilted, in the air or close to a wall.
    void sheet() {
        const double w = dice.between(0.2, 0.6) * room.x, h = dice.between(0.2, 0.6) * room.z;
        glm::dmat4 place = glm::mat4_cast(dice.chance(0.5) ? dice.turn() : orientation_of({}));
        place[3] = glm::dvec4(dice.between(0.3, 0.7) * room.x, dice.between(0.1, 0.9) * room.y,
                              dice.between(0.3, 0.7) * room.z, 1.0);
        add({{quad({-0.3 * w, 0, 0.3 * h}, {0.3 * w, 0, 0.3 * h}, {0.3 * w, 0, -0.3 * h}, {-0.3 * w, 0, -0.3 * h}),
              {}}},
            paint(), place);
    }

    std::shared_ptr<const Profile> profile() {
        constexpr const char* kNames[] = {"downlight", "narrow_spot", "batwing", "wall_washer", "linear", "flood"};
        switch (dice.upto(5)) {
            case 0:
            case 1:
                return isotropic(dice.magnitude(20.0, 2000.0));
            case 2:
                return cosine_power(dice.magnitude(100.0, 5000.0), dice.between(1.0, 4.0));
            case 3:
                return cosine_power(dice.magnitude(1000.0, 50000.0), dice.magnitude(10.0, 400.0));
            default:
                return *builtin_profile(kNames[dice.upto(std::size(kNames) - 1)]);
        }
    }
    // A point that is in nothing solid, if any of a hundred is.
    glm::dvec3 air() {
        for (int tries = 0;; ++tries) {
            const glm::dvec3 at(dice.between(0.1, 0.9) * room.x, dice.between(0.4, 0.95) * room.y,
                                dice.between(0.1, 0.9) * room.z);
            const bool free = std::none_of(solids.begin(), solids.end(), [&](const auto& solid) {
                const glm::dvec3 p(glm::inverse(solid.first) * glm::dvec4(at, 1.0));
                return std::abs(p.x) < 0.5 * solid.second.x && std::abs(p.z) < 0.5 * solid.second.z && p.y > 0.0 &&
                       p.y < solid.second.y;
            });
            if (free || tries == 100) return at;
        }
    }
    void solid(const glm::dvec3& size) {
        const glm::dmat4 place = place_for(size);
        solids.emplace_back(place, size);
        slab({-0.5 * size.x, 0.0, -0.5 * size.z}, {0.5 * size.x, size.y, 0.5 * size.z}, paint(), place);
    }
    // An open tube of thin sheet around a luminaire.
    void lampshade(const glm::dvec3& at) {
        constexpr int kSides = 12;
        const double r = dice.between(0.08, 0.25), up = dice.between(0.0, 0.2), down = dice.between(0.02, 0.3);
        const Material material = paint();
        for (int i = 0; i < kSides; ++i) {
            const double p = 2.0 * std::numbers::pi * i / kSides, q = 2.0 * std::numbers::pi * (i + 1) / kSides;
            const glm::dvec3 a(r * std::cos(p), 0, r * std::sin(p)), b(r * std::cos(q), 0, r * std::sin(q)), y(0, 1, 0);
            add({{quad(at + a - down * y, at + b - down * y, at + b + up * y, at + a + up * y), {}}}, material);
        }
    }
    // A box around a luminaire that is open below, or closed but for a slit.
    void housing(const glm::dvec3& at) {
        const double w = dice.between(0.08, 0.3), d = dice.between(0.08, 0.3), h = dice.between(0.05, 0.2), t = 0.004;
        const double open = dice.chance(0.5) ? w : 0.3 * w;
        const Material material = paint();
        const glm::dvec3 a = at - glm::dvec3(w, h, d), b = at + glm::dvec3(w, h, d);
        slab({a.x, b.y - t, a.z}, b, material);
        slab(a, {a.x + t, b.y - t, b.z}, material);
        slab({b.x - t, a.y, a.z}, {b.x, b.y - t, b.z}, material);
        slab({a.x + t, a.y, a.z}, {b.x - t, b.y - t, a.z + t}, material);
        slab({a.x + t, a.y, b.z - t}, {b.x - t, b.y - t, b.z}, material);
        if (open < w) {
            slab({a.x + t, a.y, a.z + t}, {at.x - open, a.y + t, b.z - t}, material);
            slab({at.x + open, a.y, a.z + t}, {b.x - t, a.y + t, b.z - t}, material);
        }
    }
    // Whether the way between two points meets none of the faces (Möller and Trumbore 1997).
    bool free_way(const glm::dvec3& from, const glm::dvec3& to) const {
        for (const Placed& piece : pieces) {
            const auto corner = [&](std::size_t i) {
                return glm::dvec3(piece.world_from_mesh *
                                  glm::dvec4(glm::dvec3(piece.mesh.vertices[piece.mesh.indices[i]].position), 1.0));
            };
            for (std::size_t i = 0; i + 2 < piece.mesh.indices.size(); i += 3) {
                const glm::dvec3 a = corner(i), u = corner(i + 1) - a, v = corner(i + 2) - a, d = to - from,
                                 p = glm::cross(d, v);
                const double scale = glm::dot(u, p);
                if (std::abs(scale) < 1e-12) continue;
                const glm::dvec3 s = from - a, q = glm::cross(s, u);
                const double x = glm::dot(s, p) / scale, y = glm::dot(d, q) / scale, t = glm::dot(v, q) / scale;
                if (x >= 0.0 && y >= 0.0 && x + y <= 1.0 && t >= 0.0 && t <= 1.0) return false;
            }
        }
        return true;
    }
    // Luminaires do not pass through walls: one whose opening would is a point.
    void keep_openings_free() {
        for (LightSeed& light : lights) {
            const ies::Opening& opening = light.profile->photometry.opening;
            const double reach = 0.1 + 0.75 * std::max(opening.length.base(), opening.width.base());
            bool free = true;
            for (int k = 0; k < 16; ++k) {
                const double phi = 2.0 * std::numbers::pi * k / 16;
                const glm::dvec3 in_plane(reach * std::cos(phi), reach * std::sin(phi), 0.0);
                free &= free_way(light.position, light.position + light.world_from_light * in_plane);
            }
            if (!free) light.profile = as_point(light.profile);
        }
    }
    void luminaire() {
        const glm::dvec3 at = air();
        const bool aimed = dice.chance(0.4);
        LightSeed seed = light_seed(profile(), at, aimed ? dice.turn() : orientation_of({}));
        if (dice.chance(0.3))
            for (int k = 0; k < 3; ++k) seed.color[k] = dice.between(0.2, 1.0);
        lights.push_back(std::move(seed));
        if (dice.chance(0.12))
            lampshade(at);
        else if (dice.chance(0.12))
            housing(at);
    }
    void thing() {
        const glm::dvec3 size = some_size(0.3, 1.8);
        switch (dice.upto(6)) {
            case 0:
                return cupboard(size, dice.between(0.01, 0.15), place_for(size));
            case 1:
                return niche(size, place_for(size));
            case 2:
                return box_in_box();
            case 3:
                return wall_with_hole();
            case 4:
                return sheet();
            default:
                return solid(size);
        }
    }
};

}  // namespace

Scene random_room(std::uint64_t seed) {
    Maker maker{{std::mt19937_64(seed)}, {}};
    Dice& dice = maker.dice;
    maker.room = {dice.magnitude(2.0, 12.0), dice.between(2.2, 5.0), dice.magnitude(2.0, 12.0)};
    for (Placed& face : box({0, 0, 0}, maker.room, 0.5, true)) {
        face.material = maker.paint();
        maker.pieces.push_back(std::move(face));
    }
    for (int i = dice.upto(7); i > 0; --i) maker.thing();
    const int lights = dice.chance(0.5) ? 1 : 1 + dice.upto(15);
    for (int i = 0; i < lights; ++i) maker.luminaire();
    maker.keep_openings_free();
    const double hazy = dice.chance(0.125) ? dice.magnitude(0.005, 0.1) : 0.0;
    const glm::dvec3 eye = maker.air(), room = maker.room;
    Scene scene = scene_of_pieces(std::move(maker.pieces), std::move(maker.lights));
    scene.haze.extinction_per_m = hazy;
    scene.camera = {{eye.x, 0.5 * room.y, eye.z}, {0.5 * room.x, 0.4 * room.y, 0.5 * room.z}, 1.2};
    return scene;
}

}  // namespace gonio::test

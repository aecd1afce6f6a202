// Rooms in which light arrives late or hardly escapes. Spheres with a port and closed rooms have closed forms. Behind
// keyholes and slits, and in random rooms, live light is compared with the reference and with what energy allows.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "ies/web.h"
#include "server/scene/scene.h"
#include "server/trace/path.h"
#include "server/trace/sampler.h"
#include "server/trace/sources.h"
#include "tests/scenes/random_room.h"
#include "tests/stress/drive.h"

namespace gonio::stress {
namespace {

using ies::kPi;
constexpr double kCandela = 100.0;  // of the isotropic luminaire in all rooms but the random ones
constexpr double kGap_m = 1e-3;     // between a wall and the meter that faces away from it

v1::MeterReading read_live(Bench& bench, const Scene& scene, const Meter& meter) {
    return read_meter(bench, scene, meter, Renderer::MeterQuality::interactive);
}

std::string place_of(const Bench& bench, const Meter& meter) {
    char text[160];
    std::snprintf(text, sizeof text, "%s, at %.4g,%.4g,%.4g", bench.context.c_str(), meter.point.x, meter.point.y,
                  meter.point.z);
    return text;
}

constexpr double kRadius_m = 2.0;
constexpr int kRings = 96;

// The sphere of test::inward_sphere() without the rings around +Y that a port takes up.
Placed sphere_with_port(int rings_out, double reflectance) {
    constexpr int kIndicesPerRing = 2 * kRings * 6;
    Placed piece;
    piece.mesh = test::inward_sphere(kRadius_m, kRings);
    const auto first = piece.mesh.indices.begin();
    piece.mesh.indices.erase(first, first + rings_out * kIndicesPerRing);
    piece.material = matte(reflectance);
    return piece;
}

// A luminaire in the centre lights the wall evenly: E0 = Phi / (4 pi R²) = I / R². Any two points of a sphere see each
// other with the same form factor, 1 / (4 pi R²). So each point of the wall receives rho (E0 + E) from the share 1 - f
// of its hemisphere, f the port's share of the sphere, and nothing from the port: E = rho (1 - f) (E0 + E) everywhere.
// An error of 1 - f is amplified by 1 / (1 - rho (1 - f)), which is 17 at most here.
void spheres_with_ports(Bench& bench) {
    Finding& finding = bench.findings.of(bench.group, "sphere with a port: error", 0.02);
    for (const double rho : {0.5, 0.8, 0.95}) {
        for (const int rings_out : {6, 14, 28}) {  // f = 0.0096, 0.051, 0.20
            if (bench.brief && (rho != 0.95 || rings_out != 14)) continue;
            const double edge_rad = kPi * rings_out / kRings, port_ratio = 0.5 * (1.0 - std::cos(edge_rad));
            const double returned_ratio = rho * (1.0 - port_ratio), direct_lx = kCandela / (kRadius_m * kRadius_m);
            const double truth_lx = direct_lx * returned_ratio / (1.0 - returned_ratio);
            char text[64];
            std::snprintf(text, sizeof text, "rho %g, a port of %.2g of the sphere", rho, port_ratio);
            bench.context = text;
            Scene scene =
                scene_of_pieces({sphere_with_port(rings_out, rho)}, {light_seed(test::isotropic(kCandela), {0, 0, 0})});
            scene.camera = {{0.3, 0.0, 0.0}, {kRadius_m, 0.0, 0.0}, 1.0};
            const double rim_rad = edge_rad + 0.1;
            const glm::dvec3 beside_rim(std::sin(rim_rad), std::cos(rim_rad), 0.0);
            for (const glm::dvec3& along :
                 {glm::dvec3(1, 0, 0), glm::dvec3(0, -1, 0), glm::dvec3(-0.6, 0.0, 0.8), beside_rim}) {
                // Facets lie up to 0.6 mm inside the sphere, so that the meter is in front of all of them.
                const Meter meter{along * (kRadius_m - kGap_m), -along};
                finding.note(std::abs(read_live(bench, scene, meter).indirect_lx() / truth_lx - 1.0),
                             [&] { return place_of(bench, meter); });
            }
        }
    }
}

struct Node {
    double at_m, weight_m;
};

// Gauss-Legendre quadrature over a length: three nodes in each part of at most 4 m. The weights add up to the length.
std::vector<Node> gauss_nodes(double length_m) {
    const double root = std::sqrt(0.6);
    const int parts = static_cast<int>(std::ceil(length_m / 4.0));
    const double half_m = 0.5 * length_m / parts;
    std::vector<Node> nodes;
    for (int i = 0; i < parts; ++i) {
        const double middle_m = (2 * i + 1) * half_m;
        for (const auto& [offset, weight] :
             {std::pair(-root, 5.0 / 9.0), std::pair(0.0, 8.0 / 9.0), std::pair(root, 5.0 / 9.0)})
            nodes.push_back({middle_m + offset * half_m, weight * half_m});
    }
    return nodes;
}

// Returns the area-weighted mean of the indirect illuminance on the six faces of a room from the origin to size_m, lux.
double mean_indirect_lx(Bench& bench, const Scene& scene, const glm::dvec3& size_m) {
    double flux_lm = 0.0, area_m2 = 0.0;
    const auto add_face = [&](int axis, double side) {
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        Meter meter{glm::dvec3(0.0), glm::dvec3(0.0)};
        meter.normal[axis] = 1.0 - 2.0 * side;
        meter.point[axis] = side * size_m[axis] + kGap_m * meter.normal[axis];
        for (const Node& across : gauss_nodes(size_m[u])) {
            for (const Node& along : gauss_nodes(size_m[v])) {
                meter.point[u] = across.at_m, meter.point[v] = along.at_m;
                const double node_m2 = across.weight_m * along.weight_m;
                flux_lm += node_m2 * read_live(bench, scene, meter).indirect_lx();
                area_m2 += node_m2;
            }
        }
    };
    for (int axis = 0; axis < 3; ++axis) add_face(axis, 0.0), add_face(axis, 1.0);
    return flux_lm / area_m2;
}

// All flux is absorbed in the end, whatever the room's shape: (1 - rho) (Phi + A E) = Phi, E the mean indirect
// illuminance. With the luminaire in the centre, the quadrature's own error is 0.02 % in the cube and 0.24 % in the
// long room, by a radiosity solution with patches of 0.5 m. The rest of the bound is for the surfels: direct light is
// sampled at their centres, which is uncertain by about 1 % where it is peaked, and later bounces keep that error.
void closed_rooms(Bench& bench) {
    Finding& finding = bench.findings.of(bench.group, "closed rooms: error of the mean", 0.03);
    for (const glm::dvec3& size_m : {glm::dvec3(4.0, 4.0, 4.0), glm::dvec3(9.0, 2.5, 3.0)}) {
        for (const double rho : {0.5, 0.8, 0.95}) {
            if (bench.brief && (rho != 0.95 || size_m.x != 4.0)) continue;
            const double area_m2 = 2.0 * (size_m.x * size_m.y + size_m.y * size_m.z + size_m.z * size_m.x);
            const double truth_lx = 4.0 * kPi * kCandela * rho / (area_m2 * (1.0 - rho));
            char text[96];
            std::snprintf(text, sizeof text, "rho %g, a room of %g x %g x %g m", rho, size_m.x, size_m.y, size_m.z);
            bench.context = text;
            Scene scene = scene_of_pieces(box(glm::dvec3(0.0), size_m, rho, true),
                                          {light_seed(test::isotropic(kCandela), 0.5 * size_m)});
            scene.camera = {0.4 * size_m, 0.8 * size_m, 1.0};
            finding.note(std::abs(mean_indirect_lx(bench, scene, size_m) / truth_lx - 1.0),
                         [&] { return bench.context; });
        }
    }
}

// Returns the greatest direct illuminance where the luminaires' rays end, over all channels, lux.
double greatest_direct_lx(const trace::World& world) {
    constexpr std::uint32_t kRays = 1024;  // of each luminaire
    const trace::Geometry& geometry = *world.geometry;
    float greatest_lx = 0.0f;
    for (const trace::Luminaire& luminaire : world.luminaires) {
        const glm::vec3 from(luminaire.position);
        for (std::uint32_t ray = 0; ray < kRays; ++ray) {
            trace::Sample sample(1, ray);
            double density_per_sr = 0.0;
            const glm::vec3 along(luminaire.emit(luminaire.position, sample.next(), density_per_sr));
            trace::SurfaceHit hit;
            if (!geometry.closest(from, along, geometry.step_off(from), false, hit)) continue;
            const glm::vec3 lux = trace::luminaires_direct(world, trace::receiver_of(geometry, hit), nullptr);
            greatest_lx = std::max({greatest_lx, lux.r, lux.g, lux.b});
        }
    }
    return static_cast<double>(greatest_lx);
}

// Reads the meters and checks them against energy. With E0 the greatest direct and E the greatest indirect illuminance,
// and rho the greatest reflectance, no point receives more than rho (E0 + E) from surfaces: E <= E0 rho / (1 - rho).
// The bound allows 5 % because E0 is sampled. Returns the indirect illuminance at each meter, lux.
std::vector<double> read_within_energy(Bench& bench, const Scene& scene, const std::vector<Meter>& meters) {
    const double rho = greatest_albedo(*scene.asset);
    const double most_lx = greatest_direct_lx(*trace::make_world(scene)) * rho / (1.0 - rho);
    Finding& finding = bench.findings.of(bench.group, "indirect light / the most that energy allows", 1.05);
    do {
        read_live(bench, scene, meters.front());
    } while (bench.renderer.ready(scene) !=
             Readiness::all);  // links for narrow beams are traced once a solve has met such a beam
    std::vector<double> indirect_lx;
    for (const Meter& meter : meters) {
        const v1::MeterReading reading = read_live(bench, scene, meter);
        double channel_lx = 0.0;
        for (int k = 0; k < 3; ++k) channel_lx = std::max(channel_lx, reading.indirect_rgb_lx(k));
        finding.note(channel_lx / most_lx, [&] { return place_of(bench, meter); });
        indirect_lx.push_back(reading.indirect_lx());
    }
    return indirect_lx;
}

// Compares live light with the reference at each meter. The figure is their difference, less two standard errors of the
// reference, over the smaller of the two, so that too dark counts as much as too bright. 5 % of the reference's mean
// over the meters is added to the smaller one. A figure of 0.5 is a factor of 1.5, one of 1 a factor of two.
void compare(Bench& bench, const Scene& scene, const std::vector<Meter>& meters, std::uint32_t max_passes,
             Finding& finding) {
    const std::vector<double> live_lx = read_within_energy(bench, scene, meters);
    trace::Settings settings;
    settings.noise = 0.02;
    settings.max_passes = max_passes;
    const std::vector<trace::Reading> truths = read_reference(bench, scene, meters, settings);
    double mean_lx = 0.0;
    for (const trace::Reading& truth : truths)
        mean_lx += trace::luminance(truth.indirect_lx) / static_cast<double>(truths.size());
    for (std::size_t i = 0; i < truths.size(); ++i) {
        const double truth_lx = trace::luminance(truths[i].indirect_lx), noise_lx = truths[i].indirect_error_lx;
        const double beyond_lx = std::abs(live_lx[i] - truth_lx) - 2.0 * noise_lx;
        const double scale_lx = std::min(live_lx[i], truth_lx) + 0.05 * mean_lx;
        finding.note(beyond_lx <= 0.0 ? 0.0 : beyond_lx / scale_lx, [&] {
            char text[240];
            std::snprintf(text, sizeof text, "%s: %.4g lx, reference %.4g +- %.2g lx",
                          place_of(bench, meters[i]).c_str(), live_lx[i], truth_lx, noise_lx);
            return std::string(text);
        });
    }
}

constexpr double kNookRho = 0.8;
constexpr double kBoard_m = 0.02;

void add_board(std::vector<Placed>& pieces, const glm::dvec3& low, const glm::dvec3& high) {
    for (Placed& face : box(low, high, kNookRho, false)) pieces.push_back(std::move(face));
}

// A closed cupboard of boards whose front, at +Z, leaves a slit over its full height.
void add_cupboard(std::vector<Placed>& pieces, const glm::dvec3& low, const glm::dvec3& high, double slit_x_m,
                  double slit_m) {
    const glm::dvec3 in = low + kBoard_m, out = high - kBoard_m;
    add_board(pieces, low, {high.x, in.y, high.z});
    add_board(pieces, {low.x, out.y, low.z}, high);
    add_board(pieces, {low.x, in.y, low.z}, {in.x, out.y, high.z});
    add_board(pieces, {out.x, in.y, low.z}, {high.x, out.y, high.z});
    add_board(pieces, {in.x, in.y, low.z}, {out.x, out.y, in.z});
    add_board(pieces, {in.x, in.y, out.z}, {slit_x_m, out.y, high.z});
    add_board(pieces, {slit_x_m + slit_m, in.y, out.z}, {out.x, out.y, high.z});
}

// Two rooms of 2 x 2.5 x 2 m with a keyhole of 0.1 x 0.1 m in the wall between them.
std::vector<Placed> rooms_with_keyhole() {
    constexpr double near_m = 1.99, far_m = 2.01;  // the wall's two sides, along X
    std::vector<Placed> pieces = box({0, 0, 0}, {4.0, 2.5, 2.0}, kNookRho, true);
    add_board(pieces, {near_m, 0.0, 0.0}, {far_m, 1.2, 2.0});
    add_board(pieces, {near_m, 1.3, 0.0}, {far_m, 2.5, 2.0});
    add_board(pieces, {near_m, 1.2, 0.0}, {far_m, 1.3, 0.9});
    add_board(pieces, {near_m, 1.2, 1.0}, {far_m, 1.3, 2.0});
    return pieces;
}

std::vector<Placed> room_with_cupboard() {
    std::vector<Placed> pieces = box({0, 0, 0}, {3.0, 2.5, 3.0}, kNookRho, true);
    add_cupboard(pieces, {1.0, 0.0, 0.4}, {1.8, 1.7, 0.9}, 1.39, 0.02);
    return pieces;
}

// The inner cupboard hangs inside the outer one; their slits are not in line.
std::vector<Placed> room_with_nested_cupboards() {
    std::vector<Placed> pieces = box({0, 0, 0}, {3.0, 2.5, 3.0}, kNookRho, true);
    add_cupboard(pieces, {0.8, 0.0, 0.5}, {2.0, 1.8, 1.5}, 0.9, 0.05);
    add_cupboard(pieces, {1.1, 0.4, 0.7}, {1.7, 1.4, 1.1}, 1.55, 0.05);
    return pieces;
}

// A housing under the ceiling, open below through a louvre: cells of 4 cm, finer than surfels lie apart. A plate keeps
// the luminaire's direct light from them.
constexpr double kCell_m = 0.04, kSheet_m = 0.001, kLouvreLow_m = 2.2, kLouvreHigh_m = 2.225;
std::vector<Placed> room_with_louvre() {
    constexpr double low_m = 1.2, high_m = 1.8, top_m = 2.4;
    std::vector<Placed> pieces = box({0, 0, 0}, {3.0, 2.5, 3.0}, kNookRho, true);
    add_board(pieces, {low_m - kBoard_m, top_m, low_m - kBoard_m},
              {high_m + kBoard_m, top_m + kBoard_m, high_m + kBoard_m});
    add_board(pieces, {low_m - kBoard_m, kLouvreLow_m, low_m - kBoard_m}, {low_m, top_m, high_m + kBoard_m});
    add_board(pieces, {high_m, kLouvreLow_m, low_m - kBoard_m}, {high_m + kBoard_m, top_m, high_m + kBoard_m});
    add_board(pieces, {low_m, kLouvreLow_m, low_m - kBoard_m}, {high_m, top_m, low_m});
    add_board(pieces, {low_m, kLouvreLow_m, high_m}, {high_m, top_m, high_m + kBoard_m});
    add_board(pieces, {1.35, 2.28, 1.35}, {1.65, 2.29, 1.65});
    for (int i = 1; i < 15; ++i) {
        const double from_m = low_m + i * kCell_m - 0.5 * kSheet_m, to_m = from_m + kSheet_m;
        add_board(pieces, {from_m, kLouvreLow_m, low_m}, {to_m, kLouvreHigh_m, high_m});
        add_board(pieces, {low_m, kLouvreLow_m, from_m}, {high_m, kLouvreHigh_m, to_m});
    }
    return pieces;
}

// A space that light reaches through small openings only. The eye and all meters are in it, so that the mean of the
// meters is that of the dim space.
struct Nook {
    const char* name;
    std::vector<Placed> pieces;
    glm::dvec3 luminaire_m, eye_m;
    std::vector<Meter> meters;
};

// Outside of cupboards, luminaires stand behind the plane of the front: no direct light enters by the slit.
std::vector<Nook> make_nooks() {
    const std::vector<Meter> in_cupboard = {{{1.4, 0.9, 0.421}, {0, 0, 1}},
                                            {{1.2, 0.021, 0.6}, {0, 1, 0}},
                                            {{1.021, 1.0, 0.7}, {1, 0, 0}},
                                            {{1.15, 0.8, 0.879}, {0, 0, -1}}};
    const std::vector<Meter> behind_keyhole = {{{3.999, 1.25, 0.95}, {-1, 0, 0}},
                                               {{3.0, 0.001, 1.0}, {0, 1, 0}},
                                               {{2.8, 2.499, 0.6}, {0, -1, 0}},
                                               {{2.011, 0.6, 1.5}, {1, 0, 0}}};
    const std::vector<Meter> in_inner_box = {
        {{1.4, 0.9, 0.721}, {0, 0, 1}}, {{1.3, 0.421, 0.9}, {0, 1, 0}}, {{1.121, 1.0, 0.9}, {1, 0, 0}}};
    const std::vector<Meter> in_room = {{{2.3, 1.2, 2.999}, {0, 0, -1}},
                                        {{2.4, 0.001, 2.0}, {0, 1, 0}},
                                        {{0.8, 2.499, 1.0}, {0, -1, 0}},
                                        {{2.999, 1.5, 1.2}, {-1, 0, 0}}};
    const std::vector<Meter> in_louvre = {
        {{1.4011, 2.21, 1.5}, {1, 0, 0}}, {{1.5989, 2.205, 1.38}, {-1, 0, 0}}, {{1.5, 2.215, 1.3589}, {0, 0, -1}}};
    return {{"cupboard, luminaire outside", room_with_cupboard(), {2.4, 2.0, 0.5}, {1.4, 1.2, 0.7}, in_cupboard},
            {"behind a keyhole", rooms_with_keyhole(), {1.0, 2.0, 1.5}, {3.0, 1.5, 1.0}, behind_keyhole},
            {"box in a box", room_with_nested_cupboards(), {2.5, 2.0, 0.6}, {1.4, 1.1, 0.95}, in_inner_box},
            {"cupboard, luminaire inside", room_with_cupboard(), {1.5, 1.3, 0.6}, {2.2, 1.5, 2.2}, in_room},
            {"in a louvre", room_with_louvre(), {1.5, 2.34, 1.5}, {1.42, 2.21, 1.5}, in_louvre}};
}

// About one link in 3,000 passes the keyhole, 300 in all: their noise and that of the meter's own rays, of which a few
// pass, amount to some 15 % of the light there.
void nooks(Bench& bench) {
    Finding& finding = bench.findings.of(bench.group, "keyholes and slits: live against the reference", 0.5);
    const std::vector<Nook> all = make_nooks();
    for (std::size_t i = 0; i < all.size(); i += bench.brief ? 2 : 1) {
        const Nook& nook = all[i];
        bench.context = nook.name;
        Scene scene = scene_of_pieces(nook.pieces, {light_seed(test::isotropic(kCandela), nook.luminaire_m)});
        scene.camera = {nook.eye_m, nook.meters.front().point, 1.0};
        scene.traced = trace::geometry_of(scene);
        compare(bench, scene, nook.meters, bench.brief ? 1u << 15 : 1u << 17, finding);
    }
}

// Returns places on surfaces that diffuse walks from the luminaires reach, at the first to third surface they meet.
std::vector<Meter> places_reached(const trace::World& world, unsigned count) {
    const trace::Geometry& geometry = *world.geometry;
    std::vector<Meter> meters;
    for (unsigned walk = 0; walk < 16 * count && meters.size() < count; ++walk) {
        const trace::Luminaire& luminaire = world.luminaires[walk % world.luminaires.size()];
        trace::Sample sample(2, walk);
        double density_per_sr = 0.0;
        glm::vec3 from(luminaire.position);
        glm::vec3 along(luminaire.emit(luminaire.position, sample.next(), density_per_sr));
        trace::SurfaceHit hit;
        bool met = true;
        for (unsigned step = 0; step <= walk % 3; ++step) {
            met = geometry.closest(from, along, geometry.step_off(from), false, hit);
            if (!met) break;
            from = hit.position + hit.geometric * geometry.step_off(hit.position);
            along = trace::around(hit.geometric, trace::cosine_hemisphere(sample.next()));
        }
        if (met) meters.push_back({geometry.origin() + glm::dvec3(hit.position), glm::dvec3(hit.geometric)});
    }
    return meters;
}

// Rooms up to 12 m wide have surfels some 0.3 m apart here: shadows and spots smaller than that are lost, hence the
// factor of two.
void random_rooms(Bench& bench) {
    Finding& finding = bench.findings.of(bench.group, "random rooms: live against the reference", 1.0);
    const std::uint64_t rooms = bench.brief ? 2 : 6;
    for (std::uint64_t seed = bench.seed; seed < bench.seed + rooms; ++seed) {
        bench.context = "random room " + std::to_string(seed);
        Scene scene = test::random_room(seed);
        scene.haze.extinction_per_m = 0.0;  // next to a luminaire, light scattered by haze has no upper bound
        scene.traced = trace::geometry_of(scene);
        const std::vector<Meter> meters = places_reached(*trace::make_world(scene), bench.brief ? 3 : 6);
        if (meters.empty()) continue;
        compare(bench, scene, meters, bench.brief ? 1u << 14 : 1u << 16, finding);
    }
}

}  // namespace

void cavities(Bench& bench) {
    BufferWatch watch(bench, "cavities");
    spheres_with_ports(bench);
    closed_rooms(bench);
    // As many links as goniod traces: too few of 128 would pass a small opening.
    bench.renderer.set_links(transport::kMostLinks);
    nooks(bench);
    random_rooms(bench);
    bench.renderer.set_links(kLinks);
}

}  // namespace gonio::stress

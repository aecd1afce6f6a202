// Luminaires, cameras and meters where they touch, cross or leave surfaces; receivers close to bright texels.
#include <algorithm>

#include "ies/web.h"
#include "server/scene/scene.h"
#include "tests/stress/drive.h"

namespace gonio::stress {
namespace {

using Quality = Renderer::MeterQuality;
using ies::kPi;

std::string metres(double m) {
    char text[32];
    std::snprintf(text, sizeof text, "%g m", m);
    return text;
}

// A point light in front of diffuse walls and one unoccluded bounce: what the renderer is compared with.
struct Wall {
    glm::dvec3 foot, along,
        up;  // foot: the middle of its lower edge, on the floor; along, up: half width and height, m
};

// Result: illuminance in lux at a point with a normal, bounced once off the wall, by quadrature: 400 × 400 midpoints on
// a grid that is exponential around the receiver's projection, good to 1e-4 at any distance.
double bounced(const Wall& wall, double reflectance, double candela, const glm::dvec3& light, const glm::dvec3& point,
               const glm::dvec3& normal) {
    const glm::dvec3 a = glm::normalize(wall.along), u = glm::normalize(wall.up), n = glm::cross(a, u);
    const double half = glm::length(wall.along), height = glm::length(wall.up);
    const double gap = std::max(glm::dot(point - wall.foot, n), 1e-9);
    const double pa = glm::dot(point - wall.foot, a), pu = glm::dot(point - wall.foot, u);
    constexpr int kSteps = 400;
    // x = centre + gap · sinh(t): equal steps of t are small near the receiver and large far away.
    const double ta0 = std::asinh((-half - pa) / gap), ta1 = std::asinh((half - pa) / gap);
    const double tu0 = std::asinh((0.0 - pu) / gap), tu1 = std::asinh((height - pu) / gap);
    const double da = (ta1 - ta0) / kSteps, du = (tu1 - tu0) / kSteps;
    double sum = 0.0;
    for (int i = 0; i < kSteps; ++i) {
        const double t = ta0 + (i + 0.5) * da, x = pa + gap * std::sinh(t), wx = gap * std::cosh(t) * da;
        for (int j = 0; j < kSteps; ++j) {
            const double s = tu0 + (j + 0.5) * du, y = pu + gap * std::sinh(s), wy = gap * std::cosh(s) * du;
            const glm::dvec3 q = wall.foot + x * a + y * u, l = light - q, d = point - q;
            const double l2 = glm::dot(l, l), d2 = glm::dot(d, d);
            const double lux = candela * std::max(0.0, glm::dot(n, l)) / (l2 * std::sqrt(l2));
            sum += lux * std::max(0.0, glm::dot(n, d)) * std::max(0.0, -glm::dot(normal, d)) / (d2 * d2) * wx * wy;
        }
    }
    return sum * reflectance / kPi;
}

}  // namespace

void contact(Bench& bench) {
    BufferWatch watch(bench, "contact");
    const glm::dvec3 low(-2, 0, -2), high(2, 3, 2), block_low(0.3, 0, 0.3), block_high(1.3, 1, 1.3);
    const auto room = [&](std::vector<LightSeed> lights) {
        std::vector<Placed> pieces = box(low, high, 0.8, true);
        for (Placed& piece : box(block_low, block_high, 0.5, false)) pieces.push_back(std::move(piece));
        return scene_of_pieces(std::move(pieces), std::move(lights));
    };
    struct Spot {
        const char* name;
        glm::dvec3 position;
    };
    const Spot spots[] = {{"on a wall", {0.2, 1.5, -2}},
                          {"on an edge of the room", {0.1, 0, -2}},
                          {"on a corner of the room", {-2, 0, -2}},
                          {"on a vertex of the block", {0.3, 1, 0.3}},
                          {"on an edge of the block", {0.8, 1, 0.3}},
                          {"inside the block", {0.8, 0.5, 0.8}},
                          {"behind a wall", {0, 1.5, -2.5}},
                          {"far outside", {400, 300, -500}}};
    struct Beam {
        const char* name;
        std::shared_ptr<const Profile> profile;
        glm::dquat turn;
    };
    const Beam beams[] = {
        {"isotropic", test::isotropic(1000.0), orientation_of({})},
        {"cos^30 into the surface", test::cosine_power(1000.0, 30.0), orientation_aiming({0, 0, -1})}};
    for (const Spot& spot : spots) {
        for (const Beam& beam : beams) {
            if (bench.brief && (&beam != &beams[0] || (&spot - spots) % 3 != 0)) continue;
            bench.context = std::string(beam.name) + " light " + spot.name;
            Scene scene = room({light_seed(beam.profile, spot.position, beam.turn)});
            scene.camera = {spot.position, {0.0, 1.4, 0.1}, 1.0};  // the camera stands where the light does
            const Meter meters[] = {{spot.position, {0, 1, 0}}, {{0.2, 1.5, -2}, {0, 0, 1}}};
            drive(bench, scene, meters);
        }
    }
    // Steps through a wall and through the block's corner.
    const double gaps[] = {1e-12, 1e-9, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 3e-3, 1e-2, 0.1};
    for (double gap : gaps) {
        for (double side : {1.0, -1.0}) {
            if (bench.brief && (gap != 1e-3 || side < 0.0)) continue;
            bench.context = "light " + metres(gap) + (side > 0 ? " before a wall" : " behind it");
            const glm::dvec3 position(0.2, 1.5, -2 + side * gap);
            Scene scene = room({light_seed(beams[0].profile, position)});
            scene.camera = {{0.2, 1.5, -1.7}, {0.2, 1.5, -2}, 1.0};
            const Meter meters[] = {{{0.2, 1.5, -2}, {0, 0, 1}}, {{0.21, 1.5, -2}, {0, 0, 1}}, {position, {0, 0, 1}}};
            drive(bench, scene, meters);
        }
    }
    // The luminaire exactly at what the centre pixel shows: a position relative to it of zero length.
    bench.context = "light at the centre pixel's point";
    Scene scene = room({light_seed(beams[0].profile, {0, 1.5, -2})});
    scene.camera = {{0, 1.5, 0}, {0, 1.5, -2}, 1.0};
    scene.width_px = scene.height_px = 16;
    const Meter meters[] = {{{0, 1.5, -2}, {0, 0, 1}}, {{0, 1.5, -2}, {0, 0, -1}}};
    drive(bench, scene, meters);
}

void singularity(Bench& bench) {
    BufferWatch watch(bench, "singularity");
    const double candela = 1000.0, rho = 0.8;
    const glm::dvec3 light(0, 1.5, -1.5);
    const Wall back{{0, 0, -3}, {3, 0, 0}, {0, 3, 0}}, side{{-3, 0, 0}, {0, 0, -3}, {0, 3, 0}};
    std::vector<Placed> pieces;
    const auto add = [&](const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec3& d, double r) {
        Placed piece;
        piece.mesh = test::quad(a, b, c, d);
        piece.material = matte(r);
        pieces.push_back(std::move(piece));
    };
    add({-3, 0, 3}, {3, 0, 3}, {3, 0, -3}, {-3, 0, -3}, 0.0);  // a black floor: only the walls bounce
    add({-3, 0, -3}, {3, 0, -3}, {3, 3, -3}, {-3, 3, -3}, rho);
    add({-3, 0, 3}, {-3, 0, -3}, {-3, 3, -3}, {-3, 3, 3}, rho);
    Scene scene = scene_of_pieces(std::move(pieces), {light_seed(test::isotropic(candela), light)});
    bench.context = "two walls";
    const double distances[] = {1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0};

    // Towards the wall along the axis of its brightest point: bounded by the wall's own exitance.
    const double exitance = rho * candela / (1.5 * 1.5);
    for (const Quality quality : {Quality::interactive, Quality::rsm}) {
        Finding& finding =
            bench.findings.of(bench.group,
                              quality == Quality::rsm ? "rsm illuminance / exitance, swept to contact"
                                                      : "interactive illuminance / exitance, swept to contact",
                              1.05);
        for (double gap : distances) {
            const double lux = read_meter(bench, scene, {{0.0, 1.5, -3 + gap}, {0, 0, -1}}, quality, 1).indirect_lx();
            finding.note(lux / exitance, [&] { return metres(gap); });
            finding.profile.emplace_back(metres(gap), lux / exitance);
        }
    }
    // On the floor towards the edge and towards the corner: the error of the bounded kernel against quadrature.
    struct Path {
        const char* name;
        glm::dvec3 foot, away;
    };
    for (const Path& path : {Path{"edge", {0.5, 0, -3}, {0, 0, 1}}, Path{"corner", {-3, 0, -3}, {1, 0, 1}}}) {
        for (const Quality quality : {Quality::interactive, Quality::rsm}) {
            const bool rsm = quality == Quality::rsm;
            const std::string name = std::string(rsm ? "rsm" : "interactive") + " error towards the " + path.name;
            // The sum over all texels loses light near contact; links must not.
            Finding& near = bench.findings.of(bench.group, name + ", 1 mm to 5 cm", rsm ? 1.0 : 0.1);
            Finding& far = bench.findings.of(bench.group, name + ", from 10 cm", rsm ? 0.03 : 0.05);
            for (double distance : distances) {
                const glm::dvec3 point = path.foot + path.away * distance, up(0, 1, 0);
                const double truth =
                    bounced(back, rho, candela, light, point, up) + bounced(side, rho, candela, light, point, up);
                const double error = read_meter(bench, scene, {point, up}, quality, 1).indirect_lx() / truth - 1.0;
                Finding& finding = distance < 0.1 ? near : far;
                finding.note(std::abs(error), [&] { return metres(distance); });
                finding.profile.emplace_back(metres(distance), error);
            }
        }
    }
    // The reference quality, one bounce, at the same points: it has no kernel and no bias.
    if (bench.brief) return;
    Finding& reference = bench.findings.of(bench.group, "reference error towards edge and corner, 1 mm to 1 m", 0.02);
    trace::Settings settings;
    settings.bounces = 1;
    settings.noise = 0.004;
    settings.max_passes = 1u << 17;
    for (const auto& [foot, away] : {std::pair(glm::dvec3(0.5, 0, -3), glm::dvec3(0, 0, 1)),
                                     std::pair(glm::dvec3(-3, 0, -3), glm::dvec3(1, 0, 1))}) {
        std::vector<Meter> meters;
        for (double distance : distances) meters.push_back({foot + away * distance, {0, 1, 0}});
        const std::vector<trace::Reading> readings = read_reference(bench, scene, meters, settings);
        for (std::size_t i = 0; i < readings.size(); ++i) {
            const glm::dvec3 point = meters[i].point, up(0, 1, 0);
            const double truth =
                bounced(back, rho, candela, light, point, up) + bounced(side, rho, candela, light, point, up);
            const double error = readings[i].indirect_lx.g / truth - 1.0;
            reference.note(std::abs(error), [&] { return metres(distances[i]); });
            reference.profile.emplace_back(metres(distances[i]), error);
        }
    }
}

}  // namespace gonio::stress

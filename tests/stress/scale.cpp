// The same room from millimetres to kilometres and far from the origin; candela of very different size side by side.
// Truth is the integrating sphere in closed form: direct I cos / d², one bounce rho · flux / (4 pi R²) everywhere.
#include <algorithm>

#include "ies/web.h"
#include "server/scene/scene.h"
#include "tests/scenes/show.h"
#include "tests/stress/drive.h"

namespace gonio::stress {
namespace {

using Quality = Renderer::MeterQuality;
using ies::kPi;
constexpr double kRadius = 2.0, kRho = 0.5, kCandela = 1000.0;
const glm::dvec3 kLight(0.5, 0.3, 0.4), kEye(-0.3, 0.1, 0.2), kLook(0.2, -0.1, -2.0);

// Unscaled: the sphere's radius is 2 m, its centre the origin.
double direct_lx(const glm::dvec3& point, double candela) {
    const glm::dvec3 d = point - kLight;
    return candela * glm::dot(d, glm::normalize(point)) / std::pow(glm::length(d), 3.0);
}
// After one bounce: rho Phi / (4 pi R²); after every bounce: that over 1 - rho.
double bounced_lx(double candela) {
    return kRho * candela / (kRadius * kRadius);
}
double every_bounce_lx(double candela) {
    return bounced_lx(candela) / (1.0 - kRho);
}

struct Sphere {
    double scale = 1.0;
    glm::dvec3 centre{0.0};
    glm::dvec3 world(const glm::dvec3& p) const { return centre + p * scale; }
};

const Mesh& sphere_mesh() {
    static const Mesh mesh = test::inward_sphere(kRadius, 128);
    return mesh;
}

Scene sphere_scene(const Sphere& sphere, const std::vector<double>& candela) {
    Placed piece;
    piece.mesh = sphere_mesh();
    piece.material = matte(kRho);
    piece.world_from_mesh = glm::dmat4(sphere.scale);
    piece.world_from_mesh[3] = glm::dvec4(sphere.centre, 1.0);
    std::vector<LightSeed> lights;
    for (double cd : candela)
        lights.push_back(light_seed(test::isotropic(cd * sphere.scale * sphere.scale), sphere.world(kLight)));
    Scene scene = scene_of_pieces({piece}, std::move(lights));
    scene.camera = {sphere.world(kEye), sphere.world(kLook), 1.0};
    return scene;
}

// Where the ray through a pixel's centre meets the unscaled sphere. (0, 0) is the top left.
glm::dvec3 hit(int x, int y, int width, int height) {
    const Eye eye = eye_of({kEye, kLook, 1.0}, width, height);
    const glm::dvec2 at((x + 0.5) / width * 2 - 1, 1 - (y + 0.5) / height * 2);
    const glm::dvec3 d = glm::normalize(ray_through(eye, at.x, at.y));
    const double b = glm::dot(d, kEye), c = glm::dot(kEye, kEye) - kRadius * kRadius;
    return kEye + d * (-b + std::sqrt(b * b - c));
}

// What a live frame's layers hold, in lux with the level at 1: greatest relative error of direct light, and of the mean
// of the bounced light.
struct LiveErrors {
    double direct = 0.0, bounced = 0.0;
};

// Direct and bounced errors of the light's live layers against the closed form for `candela`.
struct LiveReader {
    std::uint32_t light = 0;
    int width = 0;
    std::vector<float> direct, indirect;
    void operator()(const Inspected& item) {
        if (item.light == nullptr || item.light->id != light) return;
        if (std::string_view(item.name) == "direct") direct.assign(item.values.begin(), item.values.end());
        if (std::string_view(item.name) == "indirect") indirect.assign(item.values.begin(), item.values.end());
    }
};

// unit: lux per unit of the layer.
LiveErrors live_errors(const LiveReader& live, double unit, double candela) {
    LiveErrors errors;
    double mean = 0.0;
    const int n = live.width;
    for (int y = 0; y < n; ++y) {
        for (int x = 0; x < n; ++x) {
            const auto pixel = static_cast<std::size_t>((n - 1 - y) * n + x);
            const double truth = direct_lx(hit(x, y, n, n), candela);
            const double error = std::abs(static_cast<double>(live.direct[pixel]) * unit / truth - 1.0);
            errors.direct = std::isfinite(error) ? std::max(errors.direct, error) : error;
            mean += static_cast<double>(live.indirect[pixel * 4 + 1]) * unit / (n * n);
        }
    }
    errors.bounced = std::abs(mean / every_bounce_lx(candela) - 1.0);
    return errors;
}

struct SphereFindings {
    Finding &meter_direct, &meter_one, &meter_all, &meter_rsm, &exr_direct, &exr_bounced, &live_direct, &live_bounced,
        &reference_direct, &reference_bounced;
};

SphereFindings sphere_findings(Bench& bench) {
    const auto of = [&](const char* figure, double bound, bool gated = true) -> Finding& {
        return bench.findings.of(bench.group, figure, bound, gated);
    };
    return {of("meter: direct error", 0.005),
            of("meter: error after one bounce", 0.01),
            of("meter: error after every bounce", 0.02),
            of("meter: bounced error, rsm", 0.005),
            of("exr: direct error, worst pixel", 0.005),
            of("exr: error after one bounce, mean", 0.01),
            of("live layers: direct error, worst pixel", 0.005),
            of("live layers: error after every bounce, mean", 0.02),
            of("reference: direct error", 0.005),
            of("reference: bounced error", 0.005)};
}

// Reads the scene's only bright light every way. candela: unscaled, of the light that is on.
void check_sphere(Bench& bench, Scene& scene, const Sphere& sphere, double candela, LiveReader& live,
                  SphereFindings& found) {
    const auto where = [&] { return bench.context; };
    const auto error = [](double value, double truth) { return std::abs(value / truth - 1.0); };
    // The mesh's facets lie up to 1.5e-4 m inside the sphere: a point on the sphere itself would be behind them.
    std::vector<Meter> meters;
    std::vector<double> direct_truth;
    for (const glm::dvec3& along : {glm::dvec3{1, 0, 0}, {-0.6, 0.0, 0.8}, {0.577, -0.577, 0.577}}) {
        const glm::dvec3 d = glm::normalize(along), point = d * (kRadius * 0.9998);
        const Meter& meter = meters.emplace_back(Meter{sphere.world(point), -d});
        direct_truth.push_back(direct_lx(point, candela));
        const auto one = read_meter(bench, scene, meter, Quality::interactive, 1),
                   all = read_meter(bench, scene, meter, Quality::interactive),
                   rsm = read_meter(bench, scene, meter, Quality::rsm);
        found.meter_direct.note(error(one.direct_lx(), direct_lx(point, candela)), where);
        found.meter_one.note(error(one.indirect_lx(), bounced_lx(candela)), where);
        found.meter_all.note(error(all.indirect_lx(), every_bounce_lx(candela)), where);
        found.meter_rsm.note(error(rsm.indirect_lx(), bounced_lx(candela)), where);
    }
    trace::Settings settings;
    settings.bounces = 1;
    settings.noise = 0.001;
    settings.max_passes = 1u << 17;
    const std::vector<trace::Reading> readings = read_reference(bench, scene, meters, settings);
    for (std::size_t i = 0; i < readings.size(); ++i) {
        found.reference_direct.note(error(readings[i].direct_lx.g, direct_truth[i]), where);
        found.reference_bounced.note(error(readings[i].indirect_lx.g, bounced_lx(candela)), where);
    }
    constexpr int n = 24;
    const std::vector<float> direct = values_of(bench, scene, View::direct, n, n),
                             bounced = values_of(bench, scene, View::indirect, n, n, 1);
    double mean = 0.0;
    for (int y = 0; y < n; ++y) {
        for (int x = 0; x < n; ++x) {
            const auto pixel = static_cast<std::size_t>(y * n + x) * 4;
            const double nits_per_lux = kRho / kPi;
            found.exr_direct.note(
                error(static_cast<double>(direct[pixel]) / nits_per_lux, direct_lx(hit(x, y, n, n), candela)), where);
            mean += static_cast<double>(bounced[pixel]) / nits_per_lux / (n * n);
        }
    }
    found.exr_bounced.note(error(mean, bounced_lx(candela)), where);

    std::size_t on = 0;  // the light whose level is 1
    while (scene.lights[on].level_ratio != 1.0) ++on;
    live = {scene.lights[on].id, scene.width_px, {}, {}};
    scene.camera_rev = ++scene.scene_rev;  // the layers are written once more, where they are seen
    test::show(bench.renderer, scene);
    const double peak = scene.lights[on].profile->peak_cd;
    const LiveErrors errors = live_errors(live, peak, candela);
    found.live_direct.note(errors.direct, where);
    found.live_bounced.note(errors.bounced, where);
}

}  // namespace

void scale(Bench& bench) {
    LiveReader live;
    BufferWatch watch(bench, "scale", [&](const Inspected& item) { live(item); });
    SphereFindings found = sphere_findings(bench);
    struct Setting {
        double scale, away_m;
    };
    std::vector<Setting> settings = {{1, 0}, {1e-3, 1e5}, {1e3, 0}, {100, 1e5}};
    if (!bench.brief) {
        for (double s : {1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0, 1e3}) {
            for (double away : {0.0, 1e3, 1e5}) settings.push_back({s, away});
        }
    }
    for (const Setting& setting : settings) {
        const Sphere sphere{setting.scale, glm::normalize(glm::dvec3(0.7, -0.3, 0.6)) * setting.away_m};
        char text[80];
        std::snprintf(text, sizeof text, "scale %g, %g km from the origin", setting.scale, setting.away_m / 1e3);
        bench.context = text;
        Scene scene = sphere_scene(sphere, {kCandela});
        check_sphere(bench, scene, sphere, kCandela, live, found);
    }
}

void intensity(Bench& bench) {
    LiveReader live;
    BufferWatch watch(bench, "intensity", [&](const Inspected& item) { live(item); });
    SphereFindings found = sphere_findings(bench);
    std::vector<std::pair<double, double>> pairs = {{1e-3, 1e9}};
    if (!bench.brief) pairs = {{1e-3, 1e9}, {1.0, 1e6}, {1e-3, 1e3}, {1e6, 1e9}, {1e9, 1e9}};
    for (const auto& [weak, strong] : pairs) {
        for (int on = 0; on < 3; ++on) {  // the weak one, the strong one, both
            char text[96];
            std::snprintf(text, sizeof text, "%g cd %s beside %g cd %s", weak, on == 1 ? "off" : "on", strong,
                          on == 0 ? "off" : "on");
            bench.context = text;
            Scene scene = sphere_scene({}, {weak, strong});
            if (on == 2) {
                drive(bench, scene, {});
                const Meter meter{{1.9996, 0, 0}, {-1, 0, 0}};
                const double both = read_meter(bench, scene, meter, Quality::rsm).total_lx();
                const double truth = direct_lx(meter.point, weak + strong) + bounced_lx(weak + strong);
                bench.findings.of(bench.group, "meter: both together", 0.005).note(std::abs(both / truth - 1.0), [&] {
                    return bench.context;
                });
                continue;
            }
            scene.lights[static_cast<std::size_t>(1 - on)].level_ratio = 0.0;
            check_sphere(bench, scene, {}, on == 0 ? weak : strong, live, found);
        }
    }
}

}  // namespace gonio::stress

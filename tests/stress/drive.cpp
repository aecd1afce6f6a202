#include "tests/stress/drive.h"

#include <algorithm>
#include <bit>
#include <map>

#include "server/scene/scene.h"
#include "tests/scenes/show.h"

namespace gonio::stress {
namespace {

std::string at(const Bench& bench, const std::string& what) {
    return bench.context + ": " + what;
}

struct Range {
    bool finite;
    float least;  // at most 0
};

// Whether all are finite, and the least. Millions of texels: integer operations that compilers vectorise.
Range range_of(std::span<const float> values) {
    constexpr std::uint32_t kExponent = 0x7f800000u;
    std::uint32_t bad = 0;
    float least = 0.0f;
    for (float v : values) {
        bad |= (std::bit_cast<std::uint32_t>(v) & kExponent) == kExponent ? 1u : 0u;
        least = v < least ? v : least;
    }
    return {bad == 0, least};
}

struct BufferChecks {
    Bench& bench;
    Inspector also = {};
    std::map<std::uint32_t, double> exitance = {};  // by light id: greatest lm/m² per cd of peak

    Finding& unfinite() { return bench.findings.of(bench.group, "values that are not finite", 0.0); }
    Finding& negative() { return bench.findings.of(bench.group, "negative amounts, largest", 0.0); }

    void operator()(const Inspected& item) {
        const auto [finite, least] = range_of(item.values);
        const auto where = [&] {
            return at(bench, std::string(item.name) + (item.light != nullptr ? " of " + item.light->name : ""));
        };
        Finding& found = unfinite();
        found.checks += item.values.size() - 1;
        found.note(finite ? 0.0 : 1.0, where);
        if (also) also(item);
        if (!finite) return;
        if (!item.has_sign) negative().note(-static_cast<double>(least), where);
        const std::string name = item.name;
        if (name == "flux") check_flux(item, where);
        if (name == "surfel_direct") note_exitance(item);
        if (name == "indirect" && item.scene.technique == Technique::standard) check_exitance(item, where);
    }

    template <typename Where>
    void check_reflected(const Inspected& item, double flux_per_cd, const char* figure, double bound,
                         const Where& where) {
        const double limit = item.light->profile->flux_lm * greatest_albedo(*item.scene.asset);
        const double reflected = flux_per_cd * item.light->profile->peak_cd;
        bench.findings.of(bench.group, figure, bound)
            .note(limit > 0.0       ? reflected / limit
                  : reflected > 0.0 ? 2.0
                                    : 0.0,
                  where);
    }

    template <typename Where>
    void check_flux(const Inspected& item, const Where& where) {
        glm::dvec3 sum(0.0);
        for (std::size_t i = 0; i < item.values.size(); i += 4)
            sum += glm::dvec3(item.values[i], item.values[i + 1], item.values[i + 2]);
        check_reflected(item, std::max({sum.r, sum.g, sum.b}), "rsm: flux reflected / (emitted x albedo)", 1.005,
                        where);
    }

    // What surfaces can send after every bounce: each is at most as bright as the brightest point, rho times what falls
    // there, over what no bounce absorbs.
    void note_exitance(const Inspected& item) {
        const double albedo = greatest_albedo(*item.scene.asset);
        const double most =
            item.values.empty() ? 0.0 : static_cast<double>(*std::max_element(item.values.begin(), item.values.end()));
        exitance[item.light->id] =
            albedo < 1.0 ? most * albedo / (1.0 - albedo) / static_cast<double>(item.unit) : 1e300;
    }

    // No point can receive more from diffuse surfaces than the exitance of the brightest of them, if they fill the
    // whole hemisphere. Direct light is known at the surfels only: 1.25 allows for it.
    template <typename Where>
    void check_exitance(const Inspected& item, const Where& where) {
        float most = 0.0f;
        for (std::size_t i = 0; i < item.values.size(); i += 4)
            most = std::max({most, item.values[i], item.values[i + 1], item.values[i + 2]});
        if (!exitance.contains(item.light->id)) return;  // it was lit before anybody watched
        const double limit = exitance[item.light->id];
        bench.findings.of(bench.group, "bounced illuminance / greatest exitance", 1.25)
            .note(limit > 0.0   ? static_cast<double>(most) / limit
                  : most > 0.0f ? 2.0
                                : 0.0,
                  where);
    }
};

void check_values(Bench& bench, std::span<const float> values, const std::string& what) {
    BufferChecks checks{bench};
    const auto [finite, least] = range_of(values);
    checks.unfinite().checks += values.size() - 1;
    checks.unfinite().note(finite ? 0.0 : 1.0, [&] { return at(bench, what); });
    checks.negative().note(-static_cast<double>(least), [&] { return at(bench, what); });
}

std::string text_of(const glm::dvec3& p) {
    char text[96];
    std::snprintf(text, sizeof text, "%.6g,%.6g,%.6g", p.x, p.y, p.z);
    return text;
}

}  // namespace

double greatest_albedo(const SceneAsset& asset) {
    double greatest = 0.0;
    for (const Material& m : asset.materials) {
        const float largest = std::max({m.base_color.r, m.base_color.g, m.base_color.b});
        greatest = std::max(greatest, static_cast<double>(largest));
    }
    return greatest;
}

v1::MeterReading read_meter(Bench& bench, const Scene& scene, const Meter& meter, Renderer::MeterQuality quality,
                            int bounces) {
    const v1::MeterReading reading = bench.renderer.meter(scene, meter.point, meter.normal, quality, bounces);
    std::vector<float> values;
    for (double v : {reading.direct_lx(), reading.indirect_lx(), reading.total_lx()})
        values.push_back(static_cast<float>(v));
    for (int k = 0; k < 3; ++k) {
        values.push_back(static_cast<float>(reading.direct_rgb_lx(k)));
        values.push_back(static_cast<float>(reading.indirect_rgb_lx(k)));
    }
    check_values(bench, values,
                 std::string(quality == Renderer::MeterQuality::rsm ? "rsm" : "interactive") + " meter at " +
                     text_of(meter.point));
    return reading;
}

std::vector<float> values_of(Bench& bench, const Scene& scene, View view, int width_px, int height_px, int bounces) {
    std::vector<float> values = bench.renderer.capture(scene, view, width_px, height_px, true, bounces)->values;
    if (view != View::rsm_normal) check_values(bench, values, std::string("exr capture of ") + view_name(view));
    return values;
}

void drive(Bench& bench, Scene& scene, std::span<const Meter> meters) {
    const std::string base = bench.context;
    const auto live_frame = [&] { test::show(bench.renderer, scene); };
    for (const Technique technique : {Technique::seed_disk, Technique::seed, Technique::standard}) {
        if (bench.brief && technique == Technique::seed_disk) continue;
        const bool standard = technique == Technique::standard;
        scene.technique = technique;
        scene.samples = standard ? 1024 : 64;
        scene.technique_rev = ++scene.scene_rev;
        bench.context = base + ", " + technique_name(technique);
        live_frame();
        if (standard || !bench.brief) {
            bench.renderer.capture(scene, View::beauty, 24, 24, false);
            for (const View view : {View::beauty, View::illuminance, View::luminance})
                values_of(bench, scene, view, 16, 16);
        }
        for (const Meter& meter : meters) {
            if (!standard && &meter != &meters[0]) continue;
            read_meter(bench, scene, meter, Renderer::MeterQuality::interactive);
            if (standard) read_meter(bench, scene, meter, Renderer::MeterQuality::rsm);
        }
    }
    bench.context = base + ", reference";
    trace::Settings few;
    few.max_passes = 64;
    read_reference(bench, scene, meters, few);
    bench.context = base + ", default";
    for (const View view : {View::mask, View::rsm_depth, View::rsm_normal, View::rsm_flux})
        values_of(bench, scene, view, 32, 24);
    scene.view = View::solid;
    scene.view_rev = ++scene.scene_rev;
    live_frame();
    scene.view = View::beauty;
    scene.view_rev = ++scene.scene_rev;
    bench.context = base;
}

std::vector<trace::Reading> read_reference(Bench& bench, const Scene& scene, std::span<const Meter> meters,
                                           const trace::Settings& settings) {
    std::vector<trace::MeterPoint> points;
    for (const Meter& meter : meters) points.push_back({meter.point, meter.normal});
    const auto world = trace::make_world(scene);
    const std::vector<trace::Reading> readings = trace::measure(*world, points, settings);
    for (std::size_t i = 0; i < readings.size(); ++i) {
        const trace::Reading& r = readings[i];
        std::vector<float> values = {static_cast<float>(r.direct_error_lx), static_cast<float>(r.indirect_error_lx)};
        for (int k = 0; k < 3; ++k) {
            values.push_back(static_cast<float>(r.direct_lx[k]));
            values.push_back(static_cast<float>(r.indirect_lx[k]));
        }
        check_values(bench, values, "reference meter at " + text_of(meters[i].point));
    }
    return readings;
}

BufferWatch::BufferWatch(Bench& bench, std::string group, Inspector also) : bench_(bench) {
    bench.group = std::move(group);
    bench.renderer.inspect_with(BufferChecks{bench, std::move(also)});
}

BufferWatch::~BufferWatch() {
    bench_.renderer.inspect_with({});
}

}  // namespace gonio::stress

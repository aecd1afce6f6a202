#include "tests/bench/frames.h"

#include <algorithm>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <ostream>
#include <thread>
#include <vector>

#include "server/render/renderer.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "tests/bench/cases.h"
#include "tests/bench/frame_loop.h"

namespace gonio {
namespace {

struct Setting {
    Technique technique;
    unsigned samples;
};
// Of the default technique the samples are of no account.
constexpr Setting kSettings[] = {
    {Technique::seed, 400}, {Technique::seed, 100}, {Technique::seed_disk, 400}, {Technique::standard, kDefaultVpls}};

struct FrameRow {
    std::string scene, technique;
    std::size_t triangles = 0;
    unsigned samples = 0;
    bench::FrameTimes times;
};

FrameRow measure(Renderer& renderer, LaneEncoders& encoder, const Setting& setting, const FramesOptions& options,
                 const std::shared_ptr<const SceneAsset>& asset) {
    Scene scene = scene_of(asset);
    scene.width_px = options.width_px & ~1;
    scene.height_px = options.height_px & ~1;
    scene.technique = setting.technique;
    scene.samples = setting.samples;
    return {asset->name, technique_name(setting.technique), asset->triangles(), setting.samples,
            bench::time_frames(renderer, encoder, scene, {options.seconds}, bench::wander)};
}

double mean(const std::vector<double>& values) {
    double sum = 0.0;
    for (double v : values) sum += v;
    return sum / static_cast<double>(values.size());
}

void print_table(const std::vector<FrameRow>& rows, std::ostream& out) {
    std::string scene;
    for (const FrameRow& row : rows) {
        if (row.scene != scene) {
            scene = row.scene;
            out << "\n"
                << scene << " (" << row.triangles << " triangles)\n"
                << "technique  samples   min FPS   max FPS   average FPS   median ms   indirect ms   frames\n";
        }
        out << std::left << std::setw(11) << row.technique << std::right << std::setw(7) << row.samples << std::fixed
            << std::setprecision(2) << std::setw(10) << 1e3 / row.times.frame_ms.back() << std::setw(10)
            << 1e3 / row.times.frame_ms.front() << std::setw(14) << 1e3 / mean(row.times.frame_ms) << std::setw(12)
            << row.times.median_ms() << std::setw(14) << row.times.indirect_ms << std::setw(9)
            << row.times.frame_ms.size() << "\n";
    }
}

void print_json(const std::vector<FrameRow>& rows, const std::string& renderer, const FramesOptions& options,
                std::ostream& out) {
    nlohmann::json json = {{"renderer", renderer},
                           {"size", {options.width_px, options.height_px}},
                           {"threads", std::thread::hardware_concurrency()}};
    for (const FrameRow& row : rows) {
        json["rows"].push_back({{"scene", row.scene},
                                {"triangles", row.triangles},
                                {"technique", row.technique},
                                {"samples", row.samples},
                                {"frame_ms", row.times.median_ms()},
                                {"frame_p95_ms", row.times.p95_ms()},
                                {"fps_min", 1e3 / row.times.frame_ms.back()},
                                {"fps_max", 1e3 / row.times.frame_ms.front()},
                                {"fps_average", 1e3 / mean(row.times.frame_ms)},
                                {"indirect_ms", row.times.indirect_ms},
                                {"frames", row.times.frame_ms.size()}});
    }
    out << json.dump(2) << "\n";
}

}  // namespace

void run_frames(const FramesOptions& options, std::ostream& out) {
    const auto context = gl::Context::create({options.device, false});
    const auto encoder = bench::make_idle_encoder();
    std::vector<FrameRow> rows;
    std::vector<std::string> names = {"cornell", "atrium"};
    if (!options.scene.empty()) names = {options.scene};
    for (const std::string& name : names) {
        const auto asset = bench::bench_asset(name);
        for (const Setting& setting : kSettings) {
            Renderer renderer(*context);  // one that has met the seed technique would go on making its position map
            renderer.set_links(transport::kMostLinks);
            rows.push_back(measure(renderer, *encoder, setting, options, asset));
        }
    }
    if (options.json) return print_json(rows, context->renderer(), options, out);
    out << context->description() << "; " << std::thread::hardware_concurrency() << " threads; " << options.width_px
        << "x" << options.height_px << "; everything recomputed in each frame, one luminaire moving\n";
    print_table(rows, out);
}

}  // namespace gonio

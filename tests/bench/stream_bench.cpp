#include "tests/bench/stream_bench.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>
#include <stdexcept>
#include <vector>

#include "server/assets/assets.h"
#include "server/render/renderer.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "server/session/budget.h"
#include "tests/bench/cases.h"
#include "tests/bench/frame_loop.h"
#include "tests/gl/flip.h"
#include "tests/pictures/coding_error.h"
#include "tests/pictures/lane_viewer.h"

namespace gonio::bench {
namespace {

constexpr double kTwoPi = 6.283185307179586;
constexpr std::int64_t kFrameNs = 16'666'667;    // --target-fps 60
constexpr std::int64_t kRefineNs = 200'000'000;  // of a step of refining (RenderSession::refine)
constexpr std::int64_t kWatchRestNs = 3'000'000'000;
constexpr int kMovingFrames = 48, kFlipEvery = 4;  // of moving frames: FLIP takes a while

// What moves, `seconds` after the first frame.
struct Shot {
    const char* scene;
    void (*move)(Scene& scene, const Scene& home, double seconds);
};
constexpr Shot kShots[] = {
    {"cornell",
     [](Scene& scene, const Scene& home, double seconds) {
         Light& light = scene.lights.at(0);
         const double turn = kTwoPi * seconds / 2.0;
         light.position = home.lights[0].position + 0.3 * glm::dvec3(std::sin(turn), 0.0, std::cos(turn) - 1.0);
         light.position_rev = light.aim_rev = scene.scene_rev;
     }},
    {"atrium",
     [](Scene& scene, const Scene& home, double seconds) {
         const glm::dvec3 arm = home.camera.eye - home.camera.target;
         const double turn = kTwoPi / 12.0 * seconds, c = std::cos(turn), s = std::sin(turn);
         scene.camera.eye = home.camera.target + glm::dvec3(c * arm.x + s * arm.z, arm.y, c * arm.z - s * arm.x);
         scene.camera_rev = scene.scene_rev;
     }},
};

// One encoded frame and what became of it.
struct Shown {
    double rest_s = 0.0;  // since the last movement; below 0: while moving
    test::CodingError error;
    std::size_t bytes = 0;
    double encode_ms = 0.0;
    bool key = false;
};

struct Result {
    std::string scene;
    std::vector<Shown> shown;
    std::optional<double> lossless_s;  // of rest
};

void write_picture(const std::string& path, const std::vector<std::uint8_t>& nv12, int width_px, int height_px) {
    BytePicture bytes{width_px, height_px, {}};
    for (const glm::vec3& srgb : test::picture_of_nv12(nv12, width_px, height_px).srgb)
        for (int k = 0; k < 3; ++k) bytes.rgb.push_back(static_cast<std::uint8_t>(std::lround(255.0f * srgb[k])));
    const auto png = encode_png(bytes);
    if (!png) throw std::runtime_error(png.error().text());
    std::ofstream out(path, std::ios::binary);
    out.write(reinterpret_cast<const char*>(png->data()), static_cast<std::streamsize>(png->size()));
    if (!out.flush()) throw std::runtime_error("cannot write " + path);
}

class Run {
public:
    Run(const gl::Context& context, const Shot& shot, const StreamOptions& options)
        : shot_(shot), options_(options), renderer_(context), scene_(scene_of(bench_asset(shot.scene))), home_(scene_) {
        renderer_.set_links(transport::kMostLinks);
        renderer_.set_refinement(true);
        scene_.width_px = scene_.height_px = 800;
        result_.scene = shot.scene;
    }
    Result measure() {
        for (int n = 0; n < kMovingFrames; ++n, now_ns_ += kFrameNs) {
            ++scene_.scene_rev;
            shot_.move(scene_, home_, n / 60.0);
            frame();
            serve(-1.0, false, n % kFlipEvery == kFlipEvery - 1);
        }
        write("moving");
        rest();
        return std::move(result_);
    }

private:
    void frame() {
        renderer_.begin_frame(scene_, monotonic_ns());
        const auto done = renderer_.finish_frame(true);
        if (!done->nv12) return;
        viewer_.show({done->report.scene_rev(), done->width_px, done->height_px, done->nv12, now_ns_, now_ns_},
                     now_ns_);
    }
    // rest_s: as Shown's. Result: whether a frame came.
    bool serve(double rest_s, bool settled, bool with_flip) {
        auto received = viewer_.serve(now_ns_, settled);
        if (!received) return false;
        const gonio::Picture& newest = viewer_.newest();
        result_.shown.push_back(
            {rest_s, test::coding_error(*newest.nv12, received->nv12, newest.width_px, newest.height_px, with_flip),
             received->bytes, received->encode_ms, received->key});
        decoded_ = std::move(received->nv12);
        return true;
    }
    void rest() {
        const std::int64_t began_ns = now_ns_ - kFrameNs;
        std::int64_t refined_ns = began_ns + Budget::kRestNs + kRefineNs;  // when the next step is done
        bool written = false;
        for (; now_ns_ - began_ns < kWatchRestNs; now_ns_ += kFrameNs) {
            if (!renderer_.settled()) {
                frame();
            } else if (now_ns_ >= refined_ns && !renderer_.refined(scene_)) {
                if (renderer_.refine(scene_, [] { return false; })) frame();
                refined_ns += kRefineNs;
            }
            const double rest_s = static_cast<double>(now_ns_ - began_ns) * 1e-9;
            if (!serve(rest_s, renderer_.settled() && renderer_.refined(scene_), true)) continue;
            const bool lossless = test::visually_lossless(result_.shown.back().error);
            if (!lossless) result_.lossless_s.reset();
            if (lossless && !result_.lossless_s) result_.lossless_s = rest_s;
            if (lossless && !std::exchange(written, true)) write("rest");
        }
    }
    void write(const std::string& when) {
        if (options_.pictures.empty()) return;
        std::filesystem::create_directories(options_.pictures);
        const std::string begin = options_.pictures + "/" + result_.scene + "-" + when;
        const gonio::Picture& picture = viewer_.newest();
        write_picture(begin + "-encoded.png", *picture.nv12, picture.width_px, picture.height_px);
        write_picture(begin + "-decoded.png", decoded_, picture.width_px, picture.height_px);
    }

    const Shot& shot_;
    const StreamOptions& options_;
    Renderer renderer_;
    Scene scene_;
    const Scene home_;
    test::LaneViewer viewer_;
    std::vector<std::uint8_t> decoded_;  // of the newest frame
    std::int64_t now_ns_ = 1'000'000'000;
    Result result_;
};

// Of the frames while something moved, without the key frame.
std::vector<double> moving(const Result& result, double (*value)(const Shown&), bool of_flip = false) {
    std::vector<double> values;
    for (const Shown& shown : result.shown)
        if (shown.rest_s < 0.0 && !shown.key && (!of_flip || shown.error.flip > 0.0)) values.push_back(value(shown));
    return values;
}

struct Column {
    const char* name;
    double (*value)(const Shown&);
    bool more_is_better, of_flip;
    int digits;
};
constexpr Column kColumns[] = {
    {"y_db", [](const Shown& s) { return s.error.y_db; }, true, false, 1},
    {"rgb_db", [](const Shown& s) { return s.error.rgb_db; }, true, false, 1},
    {"flip", [](const Shown& s) { return s.error.flip; }, false, true, 4},
    {"block_flip", [](const Shown& s) { return s.error.worst_block_flip; }, false, true, 3},
    {"plain_step", [](const Shown& s) { return s.error.plain_step; }, false, false, 2},
};

double worst(const Column& column, const std::vector<double>& values) {
    return column.more_is_better ? *std::min_element(values.begin(), values.end())
                                 : *std::max_element(values.begin(), values.end());
}

nlohmann::json json_of(const Result& result) {
    nlohmann::json row = {{"scene", result.scene}, {"frames", kMovingFrames}};
    for (const Column& column : kColumns) {
        const auto values = moving(result, column.value, column.of_flip);
        row["moving"][column.name] = {{"median", median(values)}, {"worst", worst(column, values)}};
        row["rest"][column.name] = column.value(result.shown.back());
    }
    row["moving"]["kbytes"] =
        median(moving(result, [](const Shown& s) { return static_cast<double>(s.bytes) * 1e-3; }));
    row["moving"]["encode_ms"] = median(moving(result, [](const Shown& s) { return s.encode_ms; }));
    row["lossless_s"] = result.lossless_s ? nlohmann::json(*result.lossless_s) : nlohmann::json();
    return row;
}

void print(const Result& result, std::ostream& out) {
    out << result.scene << "\n             median   worst  at rest\n";
    for (const Column& column : kColumns) {
        const auto values = moving(result, column.value, column.of_flip);
        out << std::left << std::setw(11) << column.name << std::right << std::fixed << std::setprecision(column.digits)
            << std::setw(8) << median(values) << std::setw(8) << worst(column, values) << std::setw(9)
            << column.value(result.shown.back()) << "\n";
    }
    out << std::setprecision(1) << "kB a frame " << std::setw(8)
        << median(moving(result, [](const Shown& s) { return static_cast<double>(s.bytes) * 1e-3; })) << "\nencode ms  "
        << std::setprecision(2) << std::setw(8) << median(moving(result, [](const Shown& s) { return s.encode_ms; }))
        << "\nvisually lossless after ";
    if (result.lossless_s)
        out << *result.lossless_s << " s\n";
    else
        out << "more than " << static_cast<double>(kWatchRestNs) * 1e-9 << " s\n";
}

}  // namespace

void run_stream(const StreamOptions& options, std::ostream& out, std::ostream& progress) {
    const auto context = gl::Context::create({options.device, false});
    nlohmann::json json = {{"renderer", context->renderer()}};
    bool any = false;
    for (const Shot& shot : kShots) {
        if (!options.scene.empty() && options.scene != shot.scene) continue;
        any = true;
        progress << shot.scene << std::endl;
        const Result result = Run(*context, shot, options).measure();
        if (options.json)
            json["rows"].push_back(json_of(result));
        else
            print(result, out);
    }
    if (!any) throw std::runtime_error("no scene is left: see gonio-bench stream --help");
    if (options.json) out << json.dump(2) << "\n";
}

}  // namespace gonio::bench

#include "tests/bench/frame_loop.h"
#include "server/scene/scene.h"

#include <algorithm>
#include <cmath>
#include <string_view>

namespace gonio::bench {
namespace {

constexpr std::string_view kIndirectPasses[] = {"gather-weights", "surfels", "merge", "solve", "gather"};

// GPU passes are timed on the GPU, passes that work on the CPU there; a software GL runs them in between.
double pass_ms(const v1::FrameReport& report, std::string_view name) {
    double sum = 0.0;
    for (const v1::PassReport& pass : report.passes()) {
        if (pass.name() == name) sum += std::max(pass.cpu_ms(), pass.gpu_ms());
    }
    return sum;
}

}  // namespace

double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

void PassTimes::add(const v1::FrameReport& report) {
    std::map<std::string, double> sums;
    for (const v1::PassReport& pass : report.passes()) {
        if (pass.state() == "ran") sums[pass.name()] += std::max(pass.cpu_ms(), pass.gpu_ms());
    }
    for (const auto& [name, sum] : sums) ms_[name].push_back(sum);
}

std::map<std::string, double> PassTimes::medians() const {
    std::map<std::string, double> result;
    for (const auto& [name, values] : ms_) result[name] = median(values);
    return result;
}

std::vector<glm::dvec3> positions_of(const Scene& scene) {
    std::vector<glm::dvec3> home;
    for (const Light& light : scene.lights) home.push_back(light.position);
    return home;
}

void wander(Scene& scene, const std::vector<glm::dvec3>& home, int n) {
    ++scene.scene_rev;
    for (std::size_t i = 0; i < scene.lights.size(); ++i) {
        Light& light = scene.lights[i];
        light.position = home[i] + 0.05 * glm::dvec3(std::cos(0.3 * n), 0.0, std::sin(0.3 * n));
        light.position_rev = light.aim_rev = scene.scene_rev;
    }
    scene.camera_rev = scene.scene_rev;
}

void sway(Scene& scene, const std::vector<glm::dvec3>& home, int n) {
    Light& light = scene.lights.at(0);
    light.position = home[0] + glm::dvec3(n % 2 != 0 ? 0.02 : 0.0, 0.0, 0.0);
    light.position_rev = light.aim_rev = ++scene.scene_rev;
}

std::unique_ptr<LaneEncoders> make_idle_encoder() {
    LaneEncoders::Setup setup;
    setup.kinds = {"libx264"};
    setup.open = [](const std::string& kind, int width, int height) { return H264Encoder::open(width, height, kind); };
    return std::make_unique<LaneEncoders>(
        std::move(setup), LaneEncoders::Outputs{[](LaneId, const VideoStream&) {}, [](EncodedFrame, bool) {},
                                                [](EncodedFrame) {}, [] {}, [] {}, [](const std::string&) {}});
}

void encode_beside(LaneEncoders& encoder, const FinishedFrame& frame) {
    if (!frame.nv12) return;
    LaneJob job;
    job.picture = {frame.report.scene_rev(), frame.width_px,   frame.height_px, frame.nv12,
                   frame.drained_ns,         frame.rendered_ns};
    encoder.put(kFirstPrivateLane, std::move(job));
}

FrameTimes time_frames(Renderer& renderer, LaneEncoders& encoder, Scene scene, const Pace& pace, Motion motion,
                       const std::function<void()>& between) {
    const std::vector<glm::dvec3> home = positions_of(scene);
    FrameTimes times;
    std::vector<double> indirect_ms, gather_ms;
    double spent_ms = 0.0;
    int warm_up = 2;  // shaders are compiled in the first frame; a second one fills the rings
    for (int frame = 0; static_cast<int>(times.frame_ms.size()) < pace.most_frames; ++frame) {
        if (static_cast<int>(times.frame_ms.size()) >= pace.least_frames && spent_ms >= pace.seconds * 1e3) break;
        motion(scene, home, frame);
        renderer.begin_frame(scene, monotonic_ns());
        const auto done = renderer.finish_frame(true);
        const v1::FrameReport& report = done->report;
        encode_beside(encoder, *done);
        if (warm_up > 0) {
            warm_up -= report.frame_ms() > 2e3 ? 2 : 1;  // beside seconds of work what the first frame adds is nothing
            continue;
        }
        spent_ms += report.frame_ms();
        times.frame_ms.push_back(report.frame_ms());
        double indirect = 0.0;
        for (std::string_view name : kIndirectPasses) indirect += pass_ms(report, name);
        indirect_ms.push_back(indirect);
        gather_ms.push_back(pass_ms(report, "gather"));
        if (between) between();
    }
    std::sort(times.frame_ms.begin(), times.frame_ms.end());
    times.indirect_ms = median(std::move(indirect_ms));
    times.gather_ms = median(std::move(gather_ms));
    return times;
}

}  // namespace gonio::bench

// The timed loop of all benches of whole frames: everything recomputed in each frame, the H.264 encoder beside it.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "server/render/renderer.h"
#include "server/stream/lane_encoders.h"

namespace gonio::bench {

// values: at least one; the upper one of two in the middle.
double median(std::vector<double> values);

// Times of passes over frames: of each name the sum of a frame's rows that ran, on the GPU or where they work.
class PassTimes {
public:
    void add(const v1::FrameReport& report);
    std::map<std::string, double> medians() const;

private:
    std::map<std::string, std::vector<double>> ms_;
};

// Where a scene's luminaires stand, and what moves from there before frame number n.
std::vector<glm::dvec3> positions_of(const Scene& scene);
using Motion = void (*)(Scene& scene, const std::vector<glm::dvec3>& home, int n);
// All along a circle of 5 cm, the camera counted as moved, so that every pass runs.
void wander(Scene& scene, const std::vector<glm::dvec3>& home, int n);
// The first luminaire by 2 cm, in odd frames away and in even ones back; nothing else.
void sway(Scene& scene, const std::vector<glm::dvec3>& home, int n);

// How long to measure, after warm-up.
struct Pace {
    double seconds = 20.0;
    int least_frames = 5, most_frames = 50;
};

struct FrameTimes {
    std::vector<double> frame_ms;  // from draining the queue to NV12 in memory, ascending
    double indirect_ms = 0.0;      // passes of indirect light: gather-weights, surfels, merge, solve, gather; median
    double gather_ms = 0.0;        // of them gather alone; median

    double median_ms() const { return frame_ms[frame_ms.size() / 2]; }
    double p95_ms() const { return frame_ms[frame_ms.size() * 95 / 100]; }
};

// Result: an encoder as one viewer has it, whose frames go nowhere.
std::unique_ptr<LaneEncoders> make_idle_encoder();
// Gives it a frame's picture, where it has one, and does not wait.
void encode_beside(LaneEncoders& encoder, const FinishedFrame& frame);

// Times frames of a scene that moves, at least one luminaire, as large as the scene says. between: called after each
// timed frame, outside its time; may be empty. Render thread.
FrameTimes time_frames(Renderer& renderer, LaneEncoders& encoder, Scene scene, const Pace& pace, Motion motion,
                       const std::function<void()>& between = {});

}  // namespace gonio::bench

// The renderer: live frames through a readback ring, captures and meters at once. Owns all GPU state. Render thread
// only.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "ies/result.h"
#include "protocol/gonio.pb.h"
#include "server/gl/context.h"
#include "server/render/effort.h"
#include "server/render/gpu_scene.h"
#include "server/render/graph.h"
#include "server/render/light_gpu.h"
#include "server/render/programs.h"
#include "server/render/target.h"
#include "server/scene/scene.h"

namespace gonio {

struct FrameInputs;
struct Inspected;
struct Timers;
namespace shade {
struct Clusters;
struct Looks;
}  // namespace shade

inline constexpr std::size_t kMostRefined = 16;  // luminaires: each keeps 8 bytes a pixel

// A live frame that has left the GPU.
struct FinishedFrame {
    v1::FrameReport report;
    int width_px = 0, height_px = 0;
    std::shared_ptr<const std::vector<std::uint8_t>> nv12;  // null where the picture was clean
    std::int64_t drained_ns = 0, rendered_ns = 0;
};

// A captured picture, rows from the top. Exactly one of rgba8 (display) and values (the view's unit) is filled.
struct CapturedPicture {
    int width_px = 0, height_px = 0;
    std::vector<std::uint8_t> rgba8;  // 4 per pixel, sRGB-encoded
    std::vector<float> values;        // 4 per pixel: rgb and 1 where there is a surface
    v1::FrameReport report;
};

// A capture between its tiles: a value copy of the scene, and the picture as far as it is.
struct CaptureJob {
    Scene scene;
    View view = View::beauty;
    bool raw = false;
    int tile_px = 0, next_tile = 0;
    std::int64_t started_ns = 0;
    std::shared_ptr<CapturedPicture> picture;
};

std::int64_t monotonic_ns();

class Renderer {
public:
    // Where the direct light of the default technique is computed: by shaders with a shadow map, or on the CPU with a
    // shadow ray per pixel; automatic: on the CPU where the GL is software anyway.
    enum class Gather : std::uint8_t { automatic, gl, simd };
    explicit Renderer(const gl::Context& context, Gather gather = Gather::automatic);
    ~Renderer();

    // Starts a live frame of the scene: runs what moved. drained_ns: when its commands left the queue.
    void begin_frame(const Scene& scene, std::int64_t drained_ns);
    // How much work the next live frames are: an index into kEfforts.
    void set_effort(std::size_t effort) { effort_ = effort; }
    // While nothing moves, the live picture gets better: from now on `rounds` times for one luminaire, fewer in turn
    // for each of several, never for more than kMostRefined of them. 0 (the default): it stays as it is.
    void set_refinement(int rounds) { refine_rounds_ = rounds; }
    // Does a part of that, some tens of milliseconds, for the scene of the last begin_frame. interrupted: asked now and
    // then, whether to stop at once. Result: whether another frame of the same scene shows something better.
    bool refine(const Scene& scene, const std::function<bool()>& interrupted);
    // Whether refine() has nothing left to do.
    bool refined(const Scene& scene);
    // Result: the oldest frame begun, if it has left the GPU; `wait` blocks for it. Frames leave in order.
    std::optional<FinishedFrame> finish_frame(bool wait);
    std::size_t frames_in_flight() const { return in_flight_.size(); }

    // Starts a capture of the scene as it is now, at its own size; the live passes stay clean. raw: values in the
    // view's unit (lux, cd/m², cd, m) in full precision instead of display colours. Sizes are at least 1.
    std::unique_ptr<CaptureJob> begin_capture(const Scene& scene, View view, int width_px, int height_px, bool raw);
    // Renders the job's next tile, a bounded amount of work, so that live frames come in between. Result: whether the
    // picture is complete.
    bool continue_capture(CaptureJob& job);
    // Both in one, for whoever has time.
    std::shared_ptr<const CapturedPicture> capture(const Scene& scene, View view, int width_px, int height_px,
                                                   bool raw);
    // Illuminance at a point: interactive: the picture's own shadow, VPLs and occlusion; rsm: direct likewise, indirect
    // the unoccluded sum over all RSM texels in double precision. Errors: of the mean of 16 independent parts, of the
    // two halves of a checkerboard of texels; none for the seed techniques.
    enum class MeterQuality { interactive, rsm };
    v1::MeterReading meter(const Scene& scene, const glm::dvec3& point, const glm::dvec3& normal, MeterQuality quality);
    // Whether the live picture's indirect light is blocked by what stands in its way, with its near light; true unless
    // a bench wants the unoccluded part alone.
    void set_occluded(bool occluded);
    // Result: the illuminance in lux, per channel, that the live picture shows at each of its pixels, rows from the
    // bottom, 0 where there is no surface: the live target's layers times the lights' weights, as the composite pass
    // adds them. scene: the one of the last begin_frame. Reads whole layers back: for measuring, not for every frame.
    std::vector<glm::vec3> live_illuminance(const Scene& scene, bool indirect);
    // Whether the newest live frame is all there is to come of its scene: else one more frame of the same scene shows
    // more of it.
    bool settled() const { return !merged_; }

    // From now on visits what every pass writes, of live frames, captures and meters, before anything uses it
    // (server/render/inspect.h). Slow: everything is read back. Empty: stops.
    void inspect_with(std::function<void(const Inspected&)> visit);

private:
    struct InFlight;

    // live: for a live frame; else for a capture or a meter of a scene that may be older.
    void prepare(const Scene& scene, bool live);
    v1::FrameReport run(const FrameInputs& inputs, std::vector<SlotRef> wanted, Timers& timers);
    void choose_layers(FrameInputs& inputs);
    FrameInputs inputs_of(const Scene& scene, const Target& target, const Eye& eye);

    int rounds_of(const Scene& scene) const;
    unsigned vpls_of(const Scene& scene, bool live) const;

    const bool direct_by_rays_;
    int refine_rounds_ = 0;
    std::size_t effort_ = 0;
    bool occluded_ = true;
    Programs programs_;
    std::unique_ptr<GpuScene> geometry_;
    std::map<std::uint32_t, LightGpu> lights_;  // by Light::id
    std::map<const Profile*, std::weak_ptr<const WebGpu>> webs_;
    std::map<std::pair<const Profile*, unsigned>, std::weak_ptr<const shade::VplRays>> rays_;  // and how many
    std::shared_ptr<const trace::Geometry> traced_;
    std::unique_ptr<const shade::Looks> looks_;
    std::unique_ptr<const shade::Clusters> clusters_;  // empty where GL draws the live G-buffer
    shade::Pool pool_;
    Ledger ledger_;
    Target live_;
    bool merged_ = false;         // the newest live picture shows all luminaires at once
    std::uint32_t refilled_ = 0;  // id of the last luminaire whose own layers followed
    Revision last_rev_ = 0;       // of the last live frame
    std::uint32_t next_target_ = 1;
    std::deque<std::unique_ptr<InFlight>> in_flight_;
    std::vector<gl::Buffer> free_readbacks_;
    std::size_t readback_bytes_ = 0;
    std::function<void(const Inspected&)> inspector_;
};

}  // namespace gonio

// The renderer: live frames through a readback ring, captures and meters at once. Owns all GPU state. Render thread
// only.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "protocol/schema/report.pb.h"
#include "server/gl/context.h"
#include "server/lighting/glow.h"
#include "server/lighting/haze_light.h"
#include "server/render/gpu_scene.h"
#include "server/render/graph.h"
#include "server/render/light_gpu.h"
#include "server/render/live_renderer.h"
#include "server/render/programs.h"
#include "server/render/quality_level.h"
#include "server/render/target.h"
#include "server/scene/asset.h"
#include "server/scene/light.h"
#include "server/scene/limits.h"
#include "server/scene/view.h"
#include "server/transport/transport.h"

namespace gonio {

struct Scene;
struct CoarseLight;
struct FrameInputs;
struct Inspected;
struct Merged;
struct ScreenLight;
class ShownBodies;
struct Timers;
namespace lighting {
struct Clusters;
struct MaterialTable;
}  // namespace lighting

// Positions where luminaires or eyes came later and that walks for surfels begin at too: of a scene.
inline constexpr std::size_t kMostLaterSeeds = 8;

// One scene is shown, captures may wait for another one, and meters for a third. Their transports are kept.
inline constexpr std::size_t kMostKnownTransports = 3;
// The light paths of a scene as far as they are made, and what they are made of.
struct SceneTransport {
    std::shared_ptr<const SceneAsset> asset;
    std::shared_ptr<const trace::Geometry> traced;
    transport::SurfelSettings surfels;
    unsigned links = 0;            // at most, of each surfel
    bool cells = false;            // transport::Transport::cells is asked for
    std::vector<glm::vec3> seeds;  // where walks for surfels begin, or are to begin anew
    std::shared_ptr<transport::Builder> builder;
};

class Renderer final : public LiveRenderer {
public:
    // Where the direct light of the default technique is computed: by shaders with a shadow map, or on the CPU with a
    // shadow ray per pixel. Automatic: on the CPU where the GL is software anyway.
    enum class DirectLight : std::uint8_t { automatic, gl, rays };
    explicit Renderer(const gl::Context& context, DirectLight direct_light = DirectLight::automatic);
    ~Renderer() override;

    void begin_frame(const Scene& scene, std::int64_t drained_ns) override;
    void set_quality_level(std::size_t quality_level) override { quality_level_ = quality_level; }
    void set_refinement(bool wanted) override { refines_ = wanted; }
    void set_watched(bool watched) override;
    bool refine(const Scene& scene, const std::function<bool()>& interrupted) override;
    bool refined(const Scene& scene) override;
    std::optional<FinishedFrame> finish_frame(bool wait) override;
    std::size_t frames_in_flight() const override { return in_flight_.size(); }
    CapturedPicture live_picture() override;

    std::unique_ptr<CaptureJob> begin_capture(const Scene& scene, View view, int width_px, int height_px,
                                              bool raw) override;
    bool continue_capture(CaptureJob& job) override;
    // Both in one, for whoever has time.
    std::shared_ptr<const CapturedPicture> capture(const Scene& scene, View view, int width_px, int height_px, bool raw,
                                                   int bounces = trace::kAllBounces,
                                                   unsigned samples_per_pixel = kSamplesPerPixel);
    v1::MeterReading meter(const Scene& scene, const glm::dvec3& point, const glm::dvec3& normal, MeterQuality quality,
                           int bounces = trace::kAllBounces) override;
    // Texels per face side of the reflective shadow maps that are made from now on: benches compare sizes.
    void set_rsm_size(int texels) { rsm_size_ = texels; }
    // Result: the illuminance in lux, per channel, that the live picture shows at each of its pixels. Rows are from the
    // bottom; 0 where there is no surface. It is the live target's layers times the lights' weights, as the composite
    // pass adds them. The scene is the one of the last begin_frame. Reads whole layers back: for measuring, not for
    // every frame.
    std::vector<glm::vec3> live_illuminance(const Scene& scene, bool indirect);
    // Result: likewise what haze shows of luminaires, cd/m².
    std::vector<glm::vec3> live_beams(const Scene& scene);
    bool settled() const override { return settled_ && !newer_transport(); }
    Readiness ready(const Scene& scene) override;
    void set_awaited(const std::vector<const SceneAsset*>& assets) override { awaited_ = assets; }
    // From now on the transport of a scene is made beside frames, by threads that yield to everything else; before, the
    // first frame of a scene waits for it.
    void make_transport_beside() {
        transport_beside_ = true;
        links_ = transport::kMostLinks;
    }
    // So many links of each surfel are made, from the next scene on; by default those for all but narrow beams.
    void set_links(unsigned most) { links_ = most; }
    void set_surfels(const transport::SurfelSettings& settings) { surfels_ = settings; }
    // A capture shall depend on its scene alone, not on those before it. From the next scene on walks for surfels begin
    // at these points (world, m) and at no later ones. Links for narrow beams are made at once or never.
    void fix_transport(std::vector<glm::dvec3> seeds_m, bool narrow_beams) {
        fixed_seeds_ = std::move(seeds_m);
        fixed_narrow_ = narrow_beams;
    }
    // Whether a light of a scene that was captured fell on so few surfels that it is a narrow beam.
    bool met_narrow_beams() const;
    // Returns the number of luminaires whose light is kept: those of the last live frame, and those of the scene that
    // was last captured or metered.
    std::size_t lights_held() const { return lights_.size(); }
    // Of the live picture's luminaires so many keep their light apart as fit into this, kMostLayers at most and one at
    // least: those that changed last. The others are summed; one of them that changes has to be taken out of the sum,
    // which lights all the others anew, once.
    void set_layer_bytes(std::size_t bytes) { layer_bytes_ = bytes; }
    v1::TransportStats transport_stats() override;

    // From now on visits what every pass writes, of live frames, captures and meters, before anything uses it
    // (server/render/inspect.h). Slow: everything is read back. Empty: stops.
    void inspect_with(std::function<void(const Inspected&)> visit);

private:
    struct InFlight;

    // live: for a live frame; else for a capture or a meter of a scene that may be older. bounces: light after bounces
    // is asked for.
    void prepare(const Scene& scene, bool live, bool bounces = true);
    void prepare_geometry(const Scene& scene, bool live);
    void prepare_drawn(bool clustered);  // clustered: the CPU draws it too, for rays and for edges
    void prepare_target(const Scene& scene);
    void prepare_transport(const Scene& scene);
    void begin_transport(SceneTransport& made) const;
    std::shared_ptr<SceneTransport> known_transport(const Scene& scene) const;
    std::shared_ptr<SceneTransport> transport_of(const Scene& scene);
    bool looked_at(const Scene& scene);
    bool is_wanted(const SceneTransport& made) const;  // shown, captured or metered
    v1::FrameReport run(const FrameInputs& inputs, std::vector<SlotRef> wanted, Timers& timers);
    bool continue_first_bounces(CaptureJob& job, const FrameInputs& inputs);
    void choose_layers(FrameInputs& inputs);
    void keep_layers(const Scene& scene);
    std::vector<int> layers_of(const Scene& scene, const Target& target) const;
    FrameInputs inputs_of(const Scene& scene, const Target& target, ScreenLight& screen, const Eye& eye);

    bool gathers(const Scene& scene) const;
    bool newer_transport() const {
        const auto newest = own_ ? own_->builder->newest() : nullptr;
        return newest && newest != made_;
    }

    const bool direct_by_rays_;
    std::vector<const SceneAsset*> awaited_;
    const SceneAsset* shown_ = nullptr;  // of the last live frame; compared, never read
    bool watched_ = true, refines_ = false, transport_beside_ = false, settled_ = true;
    std::size_t quality_level_ = 0;
    int rsm_size_ = kRsmSize;
    Programs programs_;
    std::unique_ptr<GpuScene> geometry_;
    std::map<std::uint32_t, LightGpu> lights_;  // by Light::id
    std::map<const Profile*, std::weak_ptr<const WebGpu>> webs_;
    std::shared_ptr<const trace::Geometry> traced_;
    std::shared_ptr<SceneTransport> own_;  // of `traced_`; null until it is asked for
    std::vector<glm::dvec3> fixed_seeds_;  // of fix_transport(); empty: those of the scene that is shown
    bool fixed_narrow_ = false;            // likewise
    // Scenes whose positions were compared with the seeds of their transports; the newest last.
    std::array<std::pair<const SceneAsset*, Revision>, kMostKnownTransports> looked_{};
    transport::SurfelSettings surfels_;
    unsigned links_ = transport::kMostForwardLinks;
    std::shared_ptr<const transport::Transport> transport_;  // what passes read: `made_`, in air that absorbs
    std::shared_ptr<const transport::Transport> made_;       // by the builder
    std::array<double, 2> made_in_{};      // what that air absorbs, 1/m, and the height of its layer, m; 0: nothing
    std::uint64_t generation_ = 0;         // counts what it was
    lighting::Probes probes_;              // of its surface; of haze
    lighting::HazePoints haze_points_;     // likewise
    std::unique_ptr<ShownBodies> bodies_;  // null: the scene has none
    std::shared_ptr<const lighting::Drawn> drawn_;  // without clusters where GL draws the live G-buffer
    Pool pool_;
    PassCache pass_cache_;
    Target live_;
    std::unique_ptr<ScreenLight> live_screen_;
    transport::Solved solved_;              // the last solve, of a live picture, a still or a meter
    std::unique_ptr<CoarseLight> coarse_;   // null: nothing was metered yet
    std::unique_ptr<Merged> captured_sum_;  // luminaires that captures sum, solved once for all their tiles
    std::size_t layer_bytes_ = std::size_t{2} << 30, layer_count_ = kMostLayers;
    std::vector<std::uint32_t> layered_;          // by layer: id of its luminaire, 0: free; used where not all have one
    Revision layered_rev_ = 0;                    // of the scene they were chosen for
    std::map<std::uint32_t, glm::dvec3> in_sum_;  // PassContext::in_sum of the live picture
    std::map<std::uint32_t, glm::dvec3> weights_;  // by id, of the newest live frame; where some are summed
    bool merged_ = false;                          // the newest live picture shows all luminaires at once
    std::uint32_t refilled_ = 0;                   // id of the last luminaire whose own layers followed
    Revision last_rev_ = 0;                        // of the last live frame
    std::uint32_t next_target_ = 1;
    std::deque<std::unique_ptr<InFlight>> in_flight_;
    std::vector<gl::Buffer> free_readbacks_;
    std::size_t readback_bytes_ = 0;
    std::function<void(const Inspected&)> inspector_;
};

}  // namespace gonio

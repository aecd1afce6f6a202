// Fader boxes on the render thread: drains what hands did once a frame, reads it through the map, applies what comes
// out, and tells the boxes where their controls stand.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "protocol/surface/surface_reader.h"
#include "server/session/render_session.h"
#include "server/surfaces/control_surfaces.h"

namespace gonio {

inline constexpr std::size_t kLatencySamples = 256;
inline constexpr double kLearnWay = 0.05;  // of its range: a control that has moved so far was meant
inline constexpr double kLearnClicks = 2;
inline constexpr std::size_t kMaxLearning = 16;  // clients that wait; then the oldest is told that nothing moved

// Carries out what hands did, in its order: a preset that is saved holds what was set before it.
void carry_out(RenderSession& render_session, std::span<const SurfaceAction> actions);

class SurfaceInput {
public:
    using Reply = std::function<void(std::uint32_t session, v1::ServerMessage message)>;
    // surfaces may be null: no boxes are looked for. interval: of frames.
    SurfaceInput(ControlSurfaces* surfaces, std::int64_t interval_ns, Reply reply)
        : surfaces_(surfaces), interval_ns_(interval_ns), reply_(std::move(reply)) {}

    // Whether hands have something for the next frame.
    bool waiting();
    // Applies it: before a frame, or when nobody watches, at most once a frame time.
    void serve(RenderSession& render_session, std::int64_t now_ns);
    // Result: how long the render thread may sleep with regard to what waits here.
    std::int64_t sleep_ns(std::int64_t now_ns) const;
    // A picture of this revision was in memory at rendered_ns.
    void picture_out(Revision scene_rev, std::int64_t rendered_ns);

    v1::Surfaces describe(const Scene& scene) const;
    // Adds a row for each box that has sent what was not understood, so that `gonio sources` tells of it too.
    void add_endpoints(v1::Sources& sources) const;
    void learn(std::uint32_t session, std::uint32_t request_id, double timeout_s);
    void forget_session(std::uint32_t session);

private:
    struct Learning {
        std::uint32_t session, request_id;
        std::int64_t until_ns;
        std::map<std::pair<std::string, std::string>, double> from;  // where absolute controls stood, clicks so far
    };
    struct Unseen {
        Revision scene_rev;
        std::int64_t event_ns;
    };
    void follow_map(const Scene& scene);
    void take_updates();
    bool serve_learning(std::int64_t now_ns);
    void play_cues(RenderSession& render_session);
    void answer(const Learning& learning, const ControlInput* moved);
    void show(const Scene& scene);
    std::optional<double> latency_ms() const;

    ControlSurfaces* surfaces_;
    std::int64_t interval_ns_;
    Reply reply_;
    std::int64_t served_ns_ = 0;
    SurfaceUpdates waiting_;
    SurfaceTable table_;
    SurfaceReader reader_;
    std::optional<std::array<std::uint32_t, 4>> map_is_of_;  // revisions of map, scene and lights; roster
    std::optional<std::pair<Revision, std::uint32_t>> shown_;
    SurfaceTargets shown_values_;
    std::deque<Learning> learning_;
    std::string cue_refused_;    // why the last cue of MIDI Show Control was not played; empty: it was
    std::int64_t since_ns_ = 0;  // the first event that no revision holds yet; 0: none
    std::deque<Unseen> unseen_;
    std::deque<double> latencies_ms_;
};

}  // namespace gonio

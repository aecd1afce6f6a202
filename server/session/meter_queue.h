// Interactive and rsm meters that wait for each other. Render thread.
#pragma once

#include <chrono>
#include <deque>

#include "server/session/guarded_renderer.h"
#include "server/session/pick.h"
#include "server/session/query.h"
#include "server/session/replies.h"
#include "server/trace/sources.h"

namespace gonio {

inline constexpr std::size_t kMaxMeters = 64;  // points and grids; beyond it: "busy"

class MeterQueue {
public:
    // A meter waits until all links of its scene's light are made. Where that scene has been replaced its patience
    // ends. Then it reads what there is, with a larger stated error. While scenes come and go, nobody knows when the
    // last links will be made.
    explicit MeterQueue(std::chrono::nanoseconds patience = std::chrono::seconds(10)) : patience_(patience) {}

    // The meter is read in the scene as it is now.
    void add(const Work& work, const Scene& scene, MeterRequest request, Replies& replies);
    void add(const Work& work, const Scene& scene, Picked picked, Replies& replies);
    // Reads points, the oldest meter's first, until 8 ms are over; answers the meters that are complete. now: the scene
    // that is shown. Result: whether there is more to do at once; else none waits, or the oldest waits for light that
    // other threads make.
    bool advance(const Scene& now, GuardedRenderer& renderer, Replies& replies);
    void forget_session(std::uint32_t session);
    // Result: whether there was such a meter, which is given up; its answer is the caller's.
    bool cancel(std::uint32_t session, std::uint32_t request_id);
    bool empty() const { return waiting_.empty(); }
    // Result: the asset of the scene that is metered next; null: none is.
    const SceneAsset* next_asset() const { return empty() ? nullptr : waiting_.front().scene.asset.get(); }

private:
    struct Metering {
        Work work;
        std::int64_t asked_ns = monotonic_ns();
        Scene scene;
        MeterRequest request;
        std::vector<v1::MeterReading> readings, around;  // around: of the planes of the point that is read
        std::shared_ptr<const trace::World> world;       // made where a point is no plane
        std::optional<Picked> picked;                    // its point is metered
    };
    static void finish_point(Metering& metering, const trace::MeterPoint& point);
    void wait(Metering metering, Replies& replies);
    bool advance_first(GuardedRenderer& renderer, Replies& replies, std::int64_t until_ns);
    std::chrono::nanoseconds patience_;
    std::deque<Metering> waiting_;
};

}  // namespace gonio

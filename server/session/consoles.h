// Consoles on the render thread: drains their latest updates once a frame, reads them through the patch, and applies
// what comes out.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>

#include "protocol/dmx/patch.h"
#include "server/inputs/udp_inputs.h"
#include "server/session/render_session.h"

namespace gonio {

class Consoles {
public:
    // inputs may be null: no console is listened to. interval: the least time between two drains, one frame.
    Consoles(Inputs* inputs, std::int64_t interval_ns) : inputs_(inputs), interval_ns_(interval_ns) {}

    // Applies what arrived, unless the last time was less than the interval ago.
    void serve(RenderSession& render_session, std::int64_t now_ns);
    // Result: how long the render thread may sleep with regard to what waits here.
    std::int64_t sleep_ns(std::int64_t now_ns) const;
    // Whether the scene will change when the interval is over.
    bool anything_waits() const;
    void publish_state(const v1::State& state);
    // Result: the newest source table.
    const v1::Sources& sources();

private:
    void follow_patch(const Scene& scene);
    void read_all_again();
    void apply_dmx(RenderSession& render_session, DmxProtocol protocol, std::int64_t now_ns);
    void apply_osc(RenderSession& render_session);

    Inputs* inputs_;
    std::int64_t interval_ns_;
    std::int64_t served_ns_ = 0;
    std::int64_t retry_ns_ = 0;  // when the universes are read again because something was busy; 0: it was not
    InputUpdates waiting_;
    std::map<DmxKey, std::shared_ptr<const DmxUniverse>> universes_;  // the newest of each that the patch uses
    PatchReader reader_;
    std::vector<PropertyValue> values_;  // of the frame being applied; kept for its memory
    struct Followed {
        Revision patch, geometry, lights, groups;
        bool operator==(const Followed&) const = default;
    };
    std::optional<Followed> followed_;
    std::map<std::string, std::vector<std::uint32_t>> targets_;  // of the scene when it was followed last
    v1::Sources sources_;
};

}  // namespace gonio

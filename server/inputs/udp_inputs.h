// The consoles' side of the network: sACN, Art-Net and OSC on a thread of their own. It hands over whole universes and
// values of properties, the newest only, and never knows the scene.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ies/core/result.h"
#include "protocol/dmx/dmx.h"
#include "protocol/schema/messages.h"
#include "protocol/schema/property.h"
#include "protocol/timecode/timecode.h"
#include "server/base/queue.h"
#include "server/inputs/osc_server.h"

namespace gonio {

struct InputOptions {
    std::optional<UdpPeer> sacn, artnet, osc;  // where to listen; absent: that protocol is off. Port 0: any free one
    bool accept_preview = true;                // of sACN
    bool osc_eos = false;                      // OSC also understands and says what Eos does

    bool any() const { return sacn || artnet || osc; }
};

inline constexpr std::size_t kMaxOscUpdates = 4096;        // OSC addresses waiting for the render thread; more: refused
inline constexpr std::size_t kMaxOscPatternUpdates = 128;  // patterns among them, which are compared with every name

// What arrived since the render thread last looked: of each universe and each OSC address the newest.
struct InputUpdates {
    struct Osc {
        OscClient from;
        OscSet values;
        std::uint64_t order = 0;  // of arrival
    };
    std::map<DmxKey, std::shared_ptr<const DmxUniverse>> universes;
    std::map<std::string, Osc> osc;                             // by address
    std::size_t osc_patterns = 0;                               // of those
    std::optional<std::pair<Timecode, std::int64_t>> timecode;  // of Art-Net, and when it came, monotonic
};

class Inputs {
public:
    // wake: called on the inputs' thread when there are latest updates. Errors: "listen_failed".
    static Result<std::unique_ptr<Inputs>> start(const InputOptions& options, std::function<void()> wake);
    virtual ~Inputs() = default;  // closes everything and joins

    // Render thread. The latest updates; the source table, a new one four times a second.
    virtual Latest<InputUpdates>& updates() = 0;
    virtual Latest<v1::Sources>& table() = 0;
    // The universes that the patch uses: joined, told to consoles that ask, and sent as latest updates.
    virtual void listen_to(std::vector<DmxKey> universes) = 0;
    virtual void publish_state(v1::State state) = 0;
    // What the scene refused; beyond 256 that wait they are only counted. Of DMX it is the endpoint's last error.
    virtual void tell_refusal(OscClient to, std::string address, Error error) = 0;
    virtual void tell_refusal(DmxProtocol protocol, Error error) = 0;
};

}  // namespace gonio

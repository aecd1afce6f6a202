// Control surfaces on a thread of their own: finds them, reads them, shows them what the scene is. Knows controls and
// positions, never the scene; nothing here can make a frame wait.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "protocol/schema/surface.pb.h"
#include "server/base/queue.h"
#include "server/surfaces/replay.h"
#include "server/surfaces/surface_connection.h"

namespace gonio {

struct SurfaceOptions {
    bool on = true;
    std::vector<std::string> taken;  // "vvvv:pppp" of devices that nothing else says are control surfaces
    enum class Midi : std::uint8_t { automatic, usb, alsa } midi = Midi::automatic;
    std::map<std::string, std::string> profiles;  // "vvvv:pppp" -> .toml or .qxi
    std::optional<Replay> replay;                 // one more surface
};

inline constexpr std::size_t kMaxSurfaces = 32;            // one more is not opened
inline constexpr std::int64_t kRescan_ns = 1'000'000'000;  // for machines where nobody tells of plugging
inline constexpr std::int64_t kFirstRetry_ns = 50'000'000, kLastRetry_ns = 1'000'000'000;
inline constexpr std::int64_t kTableEvery_ns = 250'000'000;

// Devices with their default rows; `roster` counts surfaces that came or went.
struct SurfaceTable {
    v1::Surfaces table;
    std::uint32_t roster = 0;
};

// What controls shall show: device -> control -> 0..1.
using SurfaceTargets = std::map<std::string, std::map<std::string, double>>;

class ControlSurfaces {
public:
    // wake: called on the device thread after something was put into the latest updates or the table. Errors: those of
    // profiles. That there is no surface, no USB or no permission is no error: it is in the table.
    static Result<std::unique_ptr<ControlSurfaces>> start(const SurfaceOptions& options, std::function<void()> wake);
    virtual ~ControlSurfaces() = default;  // closes everything and joins

    // Render thread.
    virtual Latest<SurfaceUpdates>& updates() = 0;
    virtual Latest<SurfaceTable>& table() = 0;
    virtual void show(SurfaceTargets targets) = 0;
};

// Which way to a MIDI surface is tried first. Boxes that are owned are taken from the kernel's driver; others are
// shared.
std::vector<std::string> transports_of(SurfaceOptions::Midi midi, bool owned);

// When a surface that could not be opened is tried again: the node and its permissions come later than the event.
struct Retry {
    std::int64_t next_ns = 0, wait_ns = 0;
    void failed(std::int64_t now_ns);
};

}  // namespace gonio

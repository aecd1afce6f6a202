// One attached surface: its wire, its decoder, what it is shown, and its row of the table. Lives on the device thread.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "protocol/schema/messages.h"
#include "protocol/surface/hid_surface.h"
#include "protocol/surface/midi_surface.h"
#include "protocol/surface/surface_painter.h"
#include "protocol/surface/surface_reader.h"
#include "server/surfaces/wire.h"

namespace gonio {

// What hands did since somebody looked: of each control the newest.
struct SurfaceUpdates {
    struct Heard {
        ControlInput input;
        std::int64_t event_ns = 0;  // of the first of them, monotonic
    };
    std::map<std::pair<std::string, std::string>, Heard> controls;  // by device and control
    std::optional<std::pair<Timecode, std::int64_t>> timecode;      // the newest, and when it came, monotonic
    std::vector<std::string> cues;      // of MIDI Show Control: "go" or a number, in their order, kMaxMidiCues at most
    std::vector<std::string> attached;  // devices that came: their controls are to be picked up
    // What came after these: of each control the newest value, all clicks and presses, and the time of the first. What
    // a device said before it came anew is gone.
    void add(SurfaceUpdates later);
};

inline constexpr std::size_t kStrokesAtOnce = 32;  // messages sent to a surface before others have their turn

class SurfaceConnection {
public:
    // The decoder of a surface. Errors: "bad_descriptor".
    static Result<std::unique_ptr<SurfaceConnection>> make(FoundSurface surface, SurfaceProfile profile);

    const FoundSurface& surface() const { return surface_; }
    const std::vector<ControlSpec>& controls() const;
    const std::vector<v1::SurfaceRow>& rows() const { return profile_.rows; }
    void connect(std::unique_ptr<Wire> wire);

    // What came over the wire; adds to the latest updates.
    void take_midi(std::span<const MidiMessage> messages, std::size_t bad, std::int64_t t_ns, SurfaceUpdates& updates);
    void take_report(Bytes report, std::int64_t t_ns, SurfaceUpdates& updates);
    void take_system(MidiNews news, std::int64_t t_ns, SurfaceUpdates& updates);
    // What the controls shall show, 0..1, by name.
    void want(const std::map<std::string, double>& values);
    // Sends what is due; adds a movement that had waited for its other half.
    void tick(std::int64_t now_ns, SurfaceUpdates& updates);
    std::int64_t due_ns(std::int64_t now_ns) const;  // 0: nothing waits
    void describe(v1::SurfaceDevice& row) const;

private:
    SurfaceConnection(FoundSurface surface, SurfaceProfile profile, std::variant<MidiSurface, HidSurface> codec);
    void put(const std::vector<ControlEvent>& events, std::int64_t t_ns, SurfaceUpdates& updates);

    FoundSurface surface_;
    SurfaceProfile profile_;
    std::variant<MidiSurface, HidSurface> codec_;
    SurfacePainter painter_;
    std::unique_ptr<Wire> wire_;
    std::map<std::string, double> wanted_;
    std::size_t painted_controls_ = 0;  // how many controls there were when wanted_ was given to the painter
    std::uint32_t events_ = 0;
    IgnoredKinds ignored_;
    std::vector<std::optional<double>> heard_;  // of each control; of relative ones the sum
};

}  // namespace gonio

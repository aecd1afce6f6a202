// A MIDI surface: messages to what its controls say, values to the messages that show them. Pure: time is a parameter.
#pragma once

#include <map>
#include <vector>

#include "protocol/surface/surface_profile.h"

namespace gonio {

class MidiSurface {
public:
    explicit MidiSurface(SurfaceProfile profile);

    // Controls of the profile first; messages that it does not know become controls of their own, named by their key.
    const std::vector<ControlSpec>& controls() const { return profile_.controls; }
    const SurfaceProfile& profile() const { return profile_; }

    // Adds what the message says. Result: false where there is no room for another control.
    bool take(const MidiMessage& message, std::int64_t now_ns, std::vector<ControlEvent>& events);
    // The coarse half of a 14-bit pair waits for its fine half, at most kPairWait_ns; adds what has waited so long.
    void tick(std::int64_t now_ns, std::vector<ControlEvent>& events);
    // Result: when tick() wants to be called; 0: nothing waits.
    std::int64_t due_ns() const;

    // Result: the message that shows a value (0..1), empty for a control that shows nothing.
    std::vector<std::uint8_t> show(std::size_t control, double value) const;
    // Result: the cable of the message of show().
    std::uint8_t show_cable(std::size_t control) const { return profile_.controls[control].output.cable; }

    static constexpr std::int64_t kPairWait_ns = 5'000'000;

private:
    enum class Part : std::uint8_t { whole, coarse, fine, touch };
    struct ControlPart {
        std::size_t control;
        Part part;
    };
    struct Pair {
        std::uint32_t coarse = 0, fine = 0;
        std::int64_t waiting_since_ns = 0;  // 0: the coarse half does not wait
    };
    const ControlPart* find(const MidiKey& key) const;
    void moved(std::size_t control, std::uint32_t raw, std::vector<ControlEvent>& events);

    SurfaceProfile profile_;
    std::map<MidiKey, ControlPart> parts_;
    std::map<std::size_t, Pair> pairs_;
};

}  // namespace gonio

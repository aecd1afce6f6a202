// What a surface is shown, and when: only what differs from what it shows already, not too often, and never against the
// hand. Pure: time is a parameter.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "protocol/surface/surface_profile.h"

namespace gonio {

inline constexpr std::int64_t kPaintEvery_ns = 20'000'000;  // of one control
inline constexpr std::int64_t kHandGuard_ns = 300'000'000;  // after the hand's last word, where touch is not told

class SurfacePainter {
public:
    explicit SurfacePainter(double repaint_s = 0) : repaint_ns_(static_cast<std::int64_t>(repaint_s * 1e9)) {}

    // What a control shall show, 0..1.
    void want(std::size_t control, double value);
    // The surface has told of a control: it shows that value itself now. A motor that moved has to be told its own
    // position, or it springs back (Mackie Control).
    void heard(std::size_t control, const ControlSpec& spec, const ControlEvent& event, std::int64_t now_ns);
    // Everything is sent again: the surface is new, or has forgotten.
    void repaint();

    struct Stroke {
        std::size_t control;
        double value;
    };
    // Result: what to send now, at most `most`, the controls that have waited longest first. Values that come out as
    // the same message as the last are not sent again.
    std::vector<Stroke> due(const std::vector<ControlSpec>& controls, std::int64_t now_ns, std::size_t most);
    // Result: when due() may have more; 0: nothing waits.
    std::int64_t due_ns(const std::vector<ControlSpec>& controls, std::int64_t now_ns) const;

private:
    struct State {
        std::optional<double> wanted, shown;
        std::int64_t sent_ns = 0, heard_ns = 0;  // 0: never
        bool touched = false;
    };
    // Result: the earliest time at which the control may be sent, or nothing where nothing differs.
    std::optional<std::int64_t> ready_ns(const State& state, const ControlSpec& spec) const;
    State& at(std::size_t control);

    std::vector<State> states_;
    std::int64_t repaint_ns_, repainted_ns_ = 0;
    std::size_t next_ = 0;  // fairness: where due() goes on
};

}  // namespace gonio

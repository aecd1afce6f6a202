#include "protocol/surface/surface_painter.h"

#include <algorithm>
#include <cmath>

namespace gonio {
namespace {

// In how many steps the control shows a value: less than one of them is no difference.
double steps_of(const ControlSpec& spec) {
    switch (spec.show) {
        case ShowKind::none:
        case ShowKind::lamp:
            return 1;
        case ShowKind::ring_mcu:
            return 10;
        case ShowKind::value:
            return 127;
        case ShowKind::motor:
            return spec.steps;
    }
    return 1;
}

double quantised(const ControlSpec& spec, double value) {
    return std::round(std::clamp(value, 0.0, 1.0) * steps_of(spec));
}

}  // namespace

SurfacePainter::State& SurfacePainter::at(std::size_t control) {
    if (control >= states_.size()) states_.resize(control + 1);
    return states_[control];
}

void SurfacePainter::want(std::size_t control, double value) {
    at(control).wanted = value;
}

void SurfacePainter::heard(std::size_t control, const ControlSpec& spec, const ControlEvent& event,
                           std::int64_t now_ns) {
    State& state = at(control);
    if (event.what == ControlEvent::What::touched) {
        state.touched = event.value != 0;
        state.heard_ns = now_ns;
        return;
    }
    if (spec.kind == ControlKind::absolute) {
        state.heard_ns = now_ns;
        if (spec.show == ShowKind::motor)
            state.shown.reset();
        else
            state.shown = event.value;
    } else if (spec.kind == ControlKind::button) {
        state.shown.reset();  // many surfaces switch the lamp of a button by themselves
    }
}

void SurfacePainter::repaint() {
    for (State& state : states_) {
        state.shown.reset();
        state.sent_ns = 0;
    }
}

std::optional<std::int64_t> SurfacePainter::ready_ns(const State& state, const ControlSpec& spec) const {
    if (!state.wanted || spec.show == ShowKind::none || state.touched) return std::nullopt;
    if (state.shown && quantised(spec, *state.shown) == quantised(spec, *state.wanted)) return std::nullopt;
    std::int64_t ready = state.sent_ns == 0 ? 0 : state.sent_ns + kPaintEvery_ns;
    const bool hand = spec.kind == ControlKind::absolute && state.heard_ns != 0 && !spec.touch;
    if (hand) ready = std::max(ready, state.heard_ns + kHandGuard_ns);
    return ready;
}

std::vector<SurfacePainter::Stroke> SurfacePainter::due(const std::vector<ControlSpec>& controls, std::int64_t now_ns,
                                                        std::size_t most) {
    if (repaint_ns_ > 0 && now_ns - repainted_ns_ >= repaint_ns_) {
        repainted_ns_ = now_ns;
        for (State& state : states_) state.shown.reset();
    }
    std::vector<Stroke> strokes;
    const std::size_t count = std::min(states_.size(), controls.size());
    for (std::size_t i = 0; i < count && strokes.size() < most; ++i) {
        const std::size_t control = (next_ + i) % count;
        State& state = states_[control];
        const auto ready = ready_ns(state, controls[control]);
        if (!ready || *ready > now_ns) continue;
        strokes.push_back({control, *state.wanted});
        state.shown = state.wanted;
        state.sent_ns = now_ns;
    }
    if (!strokes.empty()) next_ = strokes.back().control + 1;
    return strokes;
}

std::int64_t SurfacePainter::due_ns(const std::vector<ControlSpec>& controls, std::int64_t now_ns) const {
    std::int64_t earliest = repaint_ns_ > 0 && !states_.empty() ? repainted_ns_ + repaint_ns_ : 0;
    for (std::size_t i = 0; i < std::min(states_.size(), controls.size()); ++i) {
        const auto ready = ready_ns(states_[i], controls[i]);
        if (!ready) continue;
        const std::int64_t at = std::max(*ready, now_ns);
        earliest = earliest == 0 ? at : std::min(earliest, at);
    }
    return earliest;
}

}  // namespace gonio

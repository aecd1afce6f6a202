#include "protocol/surface/midi_surface.h"

#include <algorithm>
#include <cmath>

namespace gonio {
namespace {

constexpr std::uint32_t kFineSteps = 16383;  // 14 bits

bool has_14_bits(MidiKind kind) {
    return kind == MidiKind::bend || kind == MidiKind::volume;
}

// Clicks of a relative message, to the right positive.
int clicks_of(RelativeCode code, std::uint32_t value) {
    const int raw = static_cast<int>(value);
    switch (code) {
        case RelativeCode::twos_complement:
            return raw < 64 ? raw : raw - 128;
        case RelativeCode::sign_bit:
            return raw < 64 ? raw : -(raw - 64);
        case RelativeCode::offset_64:
            return raw - 64;
    }
    return 0;
}

}  // namespace

const char* control_kind_name(ControlKind kind) {
    return kind == ControlKind::absolute ? "absolute" : kind == ControlKind::relative ? "relative" : "button";
}

MidiSurface::MidiSurface(SurfaceProfile profile) : profile_(std::move(profile)) {
    for (std::size_t i = 0; i < profile_.controls.size(); ++i) {
        const ControlSpec& control = profile_.controls[i];
        if (!control.input) continue;
        parts_.insert({*control.input, {i, control.pair ? Part::coarse : Part::whole}});
        if (control.pair) {
            MidiKey fine = *control.input;
            fine.number = static_cast<std::uint8_t>(fine.number + 32);
            parts_.insert({fine, {i, Part::fine}});
        }
        if (control.touch) parts_.insert({*control.touch, {i, Part::touch}});
    }
}

const MidiSurface::ControlPart* MidiSurface::find(const MidiKey& key) const {
    auto found = parts_.find(key);
    if (found == parts_.end()) {
        MidiKey any = key;
        any.channel = 0;
        found = parts_.find(any);
    }
    return found == parts_.end() ? nullptr : &found->second;
}

void MidiSurface::moved(std::size_t control, std::uint32_t raw, std::vector<ControlEvent>& events) {
    ControlSpec& spec = profile_.controls[control];
    // Boxes whose slider has 7 bits leave the fine half of the volume at 0: their full is 7F 00.
    if (spec.input && spec.input->kind == MidiKind::volume) {
        if ((raw & 0x7F) != 0) spec.steps = kFineSteps;
        if (spec.steps != kFineSteps) raw >>= 7;
    }
    double value = 0;
    if (spec.kind == ControlKind::button)
        value = raw > 0 ? 1 : 0;
    else if (spec.kind == ControlKind::relative)
        value = clicks_of(spec.code, raw);
    else
        value = std::min(1.0, static_cast<double>(raw) / spec.steps);
    events.push_back({ControlEvent::What::moved, control, value});
}

bool MidiSurface::take(const MidiMessage& message, std::int64_t now_ns, std::vector<ControlEvent>& events) {
    const MidiKey key = key_of(message);
    const std::uint32_t raw = value_of(message);
    const ControlPart* heard = find(key);
    if (heard == nullptr) {
        if (profile_.controls.size() >= kMaxSurfaceControls) return false;
        ControlSpec spec;
        spec.name = midi_key_text(key);
        spec.kind = key.kind == MidiKind::note ? ControlKind::button : ControlKind::absolute;
        spec.steps = key.kind == MidiKind::bend ? kFineSteps : 127;
        spec.input = spec.output = key;
        if (key.kind == MidiKind::note) spec.show = ShowKind::lamp;
        heard = &parts_.insert({key, {profile_.controls.size(), Part::whole}}).first->second;
        profile_.controls.push_back(std::move(spec));
    }
    switch (heard->part) {
        case Part::whole:
            moved(heard->control, raw, events);
            break;
        case Part::touch:
            events.push_back({ControlEvent::What::touched, heard->control, raw > 0 ? 1.0 : 0.0});
            break;
        case Part::coarse: {
            Pair& pair = pairs_[heard->control];
            if (pair.waiting_since_ns != 0) moved(heard->control, pair.coarse << 7 | pair.fine, events);
            pair.coarse = raw;
            pair.fine = 0;  // the MIDI specification: a new coarse value begins at fine 0
            pair.waiting_since_ns = std::max<std::int64_t>(now_ns, 1);
            break;
        }
        case Part::fine: {
            Pair& pair = pairs_[heard->control];
            pair.fine = raw;
            pair.waiting_since_ns = 0;
            moved(heard->control, pair.coarse << 7 | pair.fine, events);
            break;
        }
    }
    return true;
}

void MidiSurface::tick(std::int64_t now_ns, std::vector<ControlEvent>& events) {
    for (auto& [control, pair] : pairs_) {
        if (pair.waiting_since_ns == 0 || now_ns - pair.waiting_since_ns < kPairWait_ns) continue;
        pair.waiting_since_ns = 0;
        moved(control, pair.coarse << 7 | pair.fine, events);
    }
}

std::int64_t MidiSurface::due_ns() const {
    std::int64_t due_ns = 0;
    for (const auto& [control, pair] : pairs_) {
        if (pair.waiting_since_ns == 0) continue;
        const std::int64_t at_ns = pair.waiting_since_ns + kPairWait_ns;
        due_ns = due_ns == 0 ? at_ns : std::min(due_ns, at_ns);
    }
    return due_ns;
}

std::vector<std::uint8_t> MidiSurface::show(std::size_t control, double value) const {
    const ControlSpec& spec = profile_.controls[control];
    const double clamped = std::clamp(value, 0.0, 1.0);
    const auto scaled = [&](double most) { return static_cast<std::uint32_t>(std::lround(clamped * most)); };
    switch (spec.show) {
        case ShowKind::none:
            return {};
        case ShowKind::lamp:
            return midi_message(spec.output, clamped >= 0.5 ? spec.on : spec.off);
        case ShowKind::value:
            return midi_message(spec.output, scaled(spec.output.kind == MidiKind::volume ? kFineSteps : 127));
        case ShowKind::ring_mcu:  // high nibble 2: wrap; positions 1 to 11
            return midi_message(spec.output, 0x21 + scaled(10));
        case ShowKind::motor:
            return midi_message(spec.output, scaled(has_14_bits(spec.output.kind) ? kFineSteps : 127));
    }
    return {};
}

}  // namespace gonio

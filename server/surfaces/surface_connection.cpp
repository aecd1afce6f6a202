#include "server/surfaces/surface_connection.h"

#include "protocol/schema/surface.pb.h"

namespace gonio {

void SurfaceUpdates::add(SurfaceUpdates later) {
    if (later.timecode) timecode = later.timecode;
    for (std::string& cue : later.cues)
        if (cues.size() < kMaxMidiCues) cues.push_back(std::move(cue));
    for (std::string& device : later.attached) {
        std::erase_if(controls, [&](const auto& one) { return one.first.first == device; });
        attached.push_back(std::move(device));
    }
    for (auto& [key, heard] : later.controls) {
        auto [at, fresh] = controls.try_emplace(key, heard);
        if (fresh) continue;
        heard.input.clicks += at->second.input.clicks;
        heard.input.presses += at->second.input.presses;
        heard.event_ns = at->second.event_ns;
        at->second = std::move(heard);
    }
}

SurfaceConnection::SurfaceConnection(FoundSurface surface, SurfaceProfile profile,
                                     std::variant<MidiSurface, HidSurface> codec)
    : surface_(std::move(surface)),
      profile_(std::move(profile)),
      codec_(std::move(codec)),
      painter_(profile_.repaint_s) {}

Result<std::unique_ptr<SurfaceConnection>> SurfaceConnection::make(FoundSurface surface, SurfaceProfile profile) {
    std::variant<MidiSurface, HidSurface> codec(MidiSurface{profile});
    if (surface.transport == "hid" || surface.path == "replay hid") {
        auto hid = HidSurface::open(surface.vendor_id, surface.product_id, surface.descriptor);
        if (!hid) return hid.error();
        if (profile.name.empty()) profile.name = hid->name();
        codec = std::move(*hid);
    }
    return std::unique_ptr<SurfaceConnection>(
        new SurfaceConnection(std::move(surface), std::move(profile), std::move(codec)));
}

const std::vector<ControlSpec>& SurfaceConnection::controls() const {
    return std::visit(
        [](const auto& codec) -> const auto& { return codec.controls(); }, codec_);
}

void SurfaceConnection::connect(std::unique_ptr<Wire> wire) {
    wire_ = std::move(wire);
    const std::vector<std::uint8_t> hello =
        std::holds_alternative<HidSurface>(codec_) ? std::get<HidSurface>(codec_).hello() : profile_.hello;
    if (!hello.empty()) wire_->write(0, hello);
}

void SurfaceConnection::put(const std::vector<ControlEvent>& events, std::int64_t t_ns, SurfaceUpdates& updates) {
    const std::vector<ControlSpec>& specs = controls();
    heard_.resize(specs.size());
    for (const ControlEvent& event : events) {
        const ControlSpec& spec = specs[event.control];
        painter_.heard(event.control, spec, event, t_ns);
        ++events_;
        if (event.what != ControlEvent::What::moved) continue;
        const bool relative = spec.kind == ControlKind::relative;
        heard_[event.control] = relative ? heard_[event.control].value_or(0) + event.value : event.value;
        SurfaceUpdates::Heard& heard = updates.controls[{surface_.identity, spec.name}];
        ControlInput& input = heard.input;
        if (input.control.empty()) {
            input.device = surface_.identity;
            heard.event_ns = t_ns;
            input.control = spec.name;
            input.kind = spec.kind;
            input.steps = spec.steps;
            input.centred = spec.centred;
            input.motor = spec.show == ShowKind::motor;
            input.deadband_ratio = spec.deadband_ratio;
        }
        if (relative)
            input.clicks += event.value;
        else
            input.value = event.value;
        if (spec.kind == ControlKind::button && event.value > 0) ++input.presses;
    }
}

void SurfaceConnection::take_midi(std::span<const MidiMessage> messages, std::size_t bad, std::int64_t t_ns,
                                  SurfaceUpdates& updates) {
    auto* codec = std::get_if<MidiSurface>(&codec_);
    if (codec == nullptr) return;
    count_ignored(ignored_, "bytes of no message", static_cast<std::uint32_t>(bad));
    std::vector<ControlEvent> events;
    for (const MidiMessage& message : messages)
        if (!codec->take(message, t_ns, events)) count_ignored(ignored_, "controls beyond 1,024");
    put(events, t_ns, updates);
}

void SurfaceConnection::take_report(Bytes report, std::int64_t t_ns, SurfaceUpdates& updates) {
    auto* codec = std::get_if<HidSurface>(&codec_);
    if (codec == nullptr) return;
    std::vector<ControlEvent> events;
    if (!codec->take(report, events)) count_ignored(ignored_, "reports of another kind or length");
    put(events, t_ns, updates);
}

void SurfaceConnection::take_system(MidiNews news, std::int64_t t_ns, SurfaceUpdates& updates) {
    if (news.timecode) updates.timecode = std::pair(*news.timecode, t_ns);
    events_ += static_cast<std::uint32_t>(news.cues.size());
    for (const auto& [kind, count] : news.ignored) count_ignored(ignored_, kind, count);
    for (std::string& cue : news.cues)
        if (updates.cues.size() < kMaxMidiCues) updates.cues.push_back(std::move(cue));
}

void SurfaceConnection::want(const std::map<std::string, double>& values) {
    wanted_ = values;
    painted_controls_ = 0;
}

void SurfaceConnection::tick(std::int64_t now_ns, SurfaceUpdates& updates) {
    if (auto* codec = std::get_if<MidiSurface>(&codec_)) {
        std::vector<ControlEvent> events;
        codec->tick(now_ns, events);
        put(events, now_ns, updates);
    }
    const std::vector<ControlSpec>& specs = controls();
    if (painted_controls_ != specs.size()) {
        painted_controls_ = specs.size();
        for (std::size_t i = 0; i < specs.size(); ++i)
            if (const auto value = wanted_.find(specs[i].name); value != wanted_.end()) painter_.want(i, value->second);
    }
    if (wire_ == nullptr) return;
    if (wire_->lost()) painter_.repaint();
    for (const auto& [control, value] : painter_.due(specs, now_ns, kStrokesAtOnce)) {
        if (auto* midi = std::get_if<MidiSurface>(&codec_)) {
            const auto message = midi->show(control, value);
            if (!message.empty() && !wire_->write(midi->show_cable(control), message)) painter_.repaint();
        } else {
            const auto report = std::get<HidSurface>(codec_).show(control, value);
            if (!report.empty() && !wire_->write(0, report)) painter_.repaint();
        }
    }
}

std::int64_t SurfaceConnection::due_ns(std::int64_t now_ns) const {
    std::int64_t due = wire_ == nullptr ? 0 : painter_.due_ns(controls(), now_ns);
    if (painted_controls_ != controls().size()) due = now_ns;
    const auto* codec = std::get_if<MidiSurface>(&codec_);
    const std::int64_t pair = codec == nullptr ? 0 : codec->due_ns();
    if (pair != 0 && (due == 0 || pair < due)) due = pair;
    return due;
}

void SurfaceConnection::describe(v1::SurfaceDevice& row) const {
    row.set_profile(profile_.name);
    row.set_events(events_);
    std::uint32_t ignored = 0;
    for (const auto& [kind, count] : ignored_) {
        ignored += count;
        v1::IgnoredMessages& told = *row.add_not_understood();
        told.set_kind(kind);
        told.set_count(count);
    }
    row.set_ignored(ignored);
    const std::vector<ControlSpec>& specs = controls();
    for (std::size_t i = 0; i < specs.size(); ++i) {
        v1::SurfaceControl& control = *row.add_controls();
        control.set_name(specs[i].name);
        control.set_kind(control_kind_name(specs[i].kind));
        control.set_steps(specs[i].steps);
        const bool heard = i < heard_.size() && heard_[i];
        control.set_heard(heard);
        if (heard) control.set_value(*heard_[i]);
        control.set_feedback(specs[i].show != ShowKind::none);
    }
}

}  // namespace gonio

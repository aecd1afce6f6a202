#include "server/session/surface_input.h"

#include <algorithm>
#include <cmath>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/cue_number.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/surface.pb.h"
#include "protocol/surface/surface_map.h"
#include "server/scene/console.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

// The rows in force: those that somebody set, then those of profiles for controls that have none.
std::vector<v1::SurfaceRow> rows_in_force(const Scene& scene, const v1::Surfaces& table, bool defaults_only) {
    std::vector<v1::SurfaceRow> rows;
    if (scene.surfaces && !defaults_only) rows.assign(scene.surfaces->rows().begin(), scene.surfaces->rows().end());
    if (scene.surfaces && !scene.surfaces->with_default()) return rows;
    for (const v1::SurfaceRow& row : table.default_rows()) {
        const auto replaces = [&](const v1::SurfaceRow& set) {
            return set.control() == row.control() && means_box(set.device(), row.device());
        };
        if (!scene.surfaces || std::ranges::none_of(scene.surfaces->rows(), replaces)) rows.push_back(row);
    }
    return rows;
}

}  // namespace

// A change of the map, of the lights or of the boxes that are there.
void SurfaceInput::follow_map(const Scene& scene) {
    const std::array<std::uint32_t, 4> now = {scene.surfaces_rev, scene.geometry_rev, scene.lights_rev, table_.roster};
    if (map_is_of_ == now) return;
    const bool same_rows = map_is_of_ && (*map_is_of_)[0] == now[0] && (*map_is_of_)[3] == now[3];
    map_is_of_ = now;
    shown_.reset();
    if (!same_rows) reader_.change_rows(rows_in_force(scene, table_.table, false));
    std::vector<std::string> names;
    for (const Light& light : scene.lights) names.push_back(light.name);
    reader_.name_lights(std::move(names));
}

void SurfaceInput::take_updates() {
    if (auto table = surfaces_->table().try_take()) table_ = std::move(*table);
    if (auto updates = surfaces_->updates().try_take()) waiting_.add(std::move(*updates));
}

bool SurfaceInput::waiting() {
    if (surfaces_ == nullptr) return false;
    take_updates();
    return !waiting_.controls.empty() || waiting_.timecode || !waiting_.cues.empty() || reader_.moving();
}

// Result: whether somebody learns: then hands drive nothing.
bool SurfaceInput::serve_learning(std::int64_t now_ns) {
    while (!learning_.empty() && learning_.front().until_ns <= now_ns) {
        answer(learning_.front(), nullptr);
        learning_.pop_front();
    }
    if (learning_.empty()) return false;
    const ControlInput* moved = nullptr;
    for (Learning& learning : learning_) {
        for (const auto& [key, heard] : waiting_.controls) {
            const ControlInput& input = heard.input;
            bool meant = false;
            if (input.kind == ControlKind::button)
                meant = input.presses > 0;
            else if (input.kind == ControlKind::relative)
                meant = std::abs(learning.from[key] += input.clicks) >= kLearnClicks;
            else
                meant = std::abs(input.value - learning.from.try_emplace(key, input.value).first->second) >= kLearnWay;
            if (meant) moved = &input;
        }
    }
    if (moved != nullptr) {
        for (const Learning& learning : learning_) answer(learning, moved);
        learning_.clear();
    }
    return true;
}

void SurfaceInput::answer(const Learning& learning, const ControlInput* moved) {
    v1::ServerMessage message;
    message.set_request_id(learning.request_id);
    v1::Learned& learned = *message.mutable_learned();
    if (moved != nullptr) {
        learned.set_device(moved->device);
        learned.set_control(moved->control);
        learned.set_kind(control_kind_name(moved->kind));
        learned.set_steps(moved->steps);
        for (const v1::SurfaceDevice& device : table_.table.devices())
            if (device.device() == moved->device) learned.set_product(device.product());
    }
    if (learning.request_id != 0) reply_(learning.session, std::move(message));
}

void SurfaceInput::learn(std::uint32_t session, std::uint32_t request_id, double timeout_s) {
    if (learning_.size() >= kMaxLearning) {
        answer(learning_.front(), nullptr);
        learning_.pop_front();
    }
    if (surfaces_ == nullptr) return answer({session, request_id, 0, {}}, nullptr);  // no box is looked for
    // Where a control is known to stand, a single movement is enough.
    Learning learning{session, request_id, monotonic_ns() + static_cast<std::int64_t>(timeout_s * 1e9), {}};
    for (const v1::SurfaceDevice& device : table_.table.devices())
        for (const v1::SurfaceControl& control : device.controls())
            if (control.heard() && control.kind() == "absolute")
                learning.from[{device.device(), control.name()}] = control.value();
    const auto at = std::find_if(learning_.begin(), learning_.end(),
                                 [&](const Learning& other) { return other.until_ns > learning.until_ns; });
    learning_.insert(at, std::move(learning));
}

void SurfaceInput::forget_session(std::uint32_t session) {
    std::erase_if(learning_, [&](const Learning& learning) { return learning.session == session; });
}

void carry_out(RenderSession& render_session, std::span<const SurfaceAction> actions) {
    std::vector<PropertyValue> values;
    const auto set = [&] {
        render_session.apply_inputs(commands_of(render_session.scene(), values));
        values.clear();
    };
    for (const SurfaceAction& action : actions) {
        if (action.kind == SurfaceAction::Kind::set) {
            values.push_back(action.value);
            continue;
        }
        set();  // what is saved is what was set before
        v1::Command command;
        if (action.kind == SurfaceAction::Kind::cue)
            command = cue_command(action.value.name);
        else
            command.mutable_save_preset()->set_name(action.value.name);
        render_session.apply_inputs({&command, 1});
    }
    set();
}

// Of MIDI Show Control, as if somebody had said them: also while controls are learned.
void SurfaceInput::play_cues(RenderSession& render_session) {
    const Revision before = render_session.scene().scene_rev;
    for (const std::string& cue : std::exchange(waiting_.cues, {})) {
        const v1::Command command = cue_command(cue);
        for (const auto& refused : render_session.apply_inputs({&command, 1}))
            cue_refused_ = refused ? "MIDI Show Control: " + refused->text() : "";
    }
    render_session.tell_inputs(before);
}

void SurfaceInput::serve(RenderSession& render_session, std::int64_t now_ns) {
    if (surfaces_ == nullptr) return;
    take_updates();
    follow_map(render_session.scene());
    if (const auto time = std::exchange(waiting_.timecode, std::nullopt))
        render_session.hear_timecode(TimecodeSource::mtc, time->first, time->second);
    play_cues(render_session);
    const Revision before = render_session.scene().scene_rev;
    if (!waiting_.controls.empty() || !waiting_.attached.empty() || reader_.moving() || !learning_.empty()) {
        for (const std::string& device : waiting_.attached) reader_.attached(device);
        std::vector<SurfaceAction> actions;
        const ValueNow now = values_now(render_session.scene());
        if (serve_learning(now_ns)) {
            reader_.let_go(actions);  // hands search for a control: nothing goes on moving meanwhile
        } else {
            for (const auto& [key, heard] : waiting_.controls) {
                reader_.take(heard.input, now_ns, now, actions);
                since_ns_ = since_ns_ == 0 ? heard.event_ns : std::min(since_ns_, heard.event_ns);
            }
            reader_.step(now_ns, now, actions);
        }
        carry_out(render_session, actions);
        render_session.tell_inputs(before);
        waiting_ = {};
        const Revision after = render_session.scene().scene_rev;
        if (since_ns_ != 0 && after != before) unseen_.push_back({after, since_ns_});
        if (after != before || !reader_.moving()) since_ns_ = 0;
        if (unseen_.size() > kLatencySamples) unseen_.pop_front();
    }
    served_ns_ = now_ns;
    show(render_session.scene());
}

std::int64_t SurfaceInput::sleep_ns(std::int64_t now_ns) const {
    constexpr std::int64_t kIdle_ns = 250'000'000;
    if (surfaces_ == nullptr) return kIdle_ns;
    if (!waiting_.controls.empty() || waiting_.timecode || !waiting_.cues.empty() || reader_.moving())
        return std::clamp<std::int64_t>(served_ns_ + interval_ns_ - now_ns, 0, kIdle_ns);
    if (!learning_.empty()) return std::clamp<std::int64_t>(learning_.front().until_ns - now_ns, 0, kIdle_ns);
    return kIdle_ns;
}

// Where controls stand for the scene as it is; told only where that differs from the last time.
void SurfaceInput::show(const Scene& scene) {
    const std::pair<Revision, std::uint32_t> now{scene.scene_rev, reader_.page()};
    if (shown_ == now) return;
    shown_ = now;
    SurfaceTargets targets;
    const ValueNow values = values_now(scene);
    for (const v1::SurfaceDevice& device : table_.table.devices()) {
        for (const v1::SurfaceControl& control : device.controls()) {
            if (!control.feedback()) continue;
            const auto value = reader_.shown(device.device(), control.name(), values, scene.recalled,
                                             print_cue_number(scene.cue_active));
            targets[device.device()][control.name()] = value.value_or(0);  // what drives nothing is dark
        }
    }
    if (targets == shown_values_) return;
    shown_values_ = targets;
    surfaces_->show(std::move(targets));
}

void SurfaceInput::picture_out(Revision scene_rev, std::int64_t rendered_ns) {
    while (!unseen_.empty() && unseen_.front().scene_rev <= scene_rev) {
        const std::int64_t latency_ns = rendered_ns - unseen_.front().event_ns;
        unseen_.pop_front();
        // What changed nothing that is seen has no picture of its own: a much later one is not its picture.
        if (latency_ns > 1'000'000'000) continue;
        latencies_ms_.push_back(static_cast<double>(latency_ns) * 1e-6);
        if (latencies_ms_.size() > kLatencySamples) latencies_ms_.pop_front();
    }
}

std::optional<double> SurfaceInput::latency_ms() const {
    if (latencies_ms_.empty()) return std::nullopt;
    std::vector<double> sorted(latencies_ms_.begin(), latencies_ms_.end());
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
    return sorted[sorted.size() / 2];
}

void SurfaceInput::add_endpoints(v1::Sources& sources) const {
    for (const v1::SurfaceDevice& device : table_.table.devices()) {
        if (device.state() != "live" || device.not_understood().empty()) continue;
        v1::InputEndpoint& row = *sources.add_endpoints();
        row.set_protocol("box");
        row.set_address(device.device());
        row.set_packets(device.events() + device.ignored());
        row.set_bad_packets(device.ignored());
        std::string kinds;
        for (const v1::IgnoredMessages& ignored : device.not_understood())
            kinds +=
                (kinds.empty() ? "not understood: " : ", ") + std::to_string(ignored.count()) + " x " + ignored.kind();
        row.set_last_error(kinds);
    }
}

v1::Surfaces SurfaceInput::describe(const Scene& scene) const {
    v1::Surfaces surfaces;
    *surfaces.mutable_devices() = table_.table.devices();
    if (scene.surfaces) *surfaces.mutable_rows() = scene.surfaces->rows();
    for (v1::SurfaceRow& row : rows_in_force(scene, table_.table, true)) *surfaces.add_default_rows() = std::move(row);
    surfaces.set_with_default(!scene.surfaces || scene.surfaces->with_default());
    surfaces.set_page(reader_.page());
    for (std::string& warning : surface_warnings(scene)) surfaces.add_warnings(std::move(warning));
    if (!cue_refused_.empty()) surfaces.add_warnings(cue_refused_);
    if (const auto median = latency_ms()) surfaces.set_latency_ms(*median);
    return surfaces;
}

}  // namespace gonio

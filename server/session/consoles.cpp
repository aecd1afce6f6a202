#include "server/session/consoles.h"

#include <algorithm>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/console.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/scene/console.h"
#include "server/scene/scene.h"

namespace gonio {

static constexpr std::int64_t kRetry_ns = 250'000'000;  // after the loader was busy

// Reads all universes anew after a change of the patch, of the scene, or of its lights and groups. Where the patch
// stays only what had no target, or another one, speaks again: the page's changes to other lights stay.
void Consoles::follow_patch(const Scene& scene) {
    const Followed now = {scene.patch_rev, scene.geometry_rev, scene.lights_rev, scene.groups_rev};
    if (followed_ == now) return;
    // The default patch changes with the lights.
    const bool same_patch = followed_ && followed_->patch == now.patch && followed_->geometry == now.geometry &&
                            (scene.patch || followed_->lights == now.lights);
    followed_ = now;
    auto targets = targets_of(scene);
    if (same_patch) {
        for (const auto& [name, lights] : targets) {
            const auto before = targets_.find(name);
            if (before == targets_.end() || before->second != lights) reader_.forget(name);
        }
    } else {
        const v1::Patch patch = patch_in_force(scene);
        reader_ = PatchReader(patch);
        const std::vector<DmxKey> wanted = universes_of(patch);
        inputs_->listen_to(wanted);
        std::erase_if(universes_,
                      [&](const auto& one) { return !std::binary_search(wanted.begin(), wanted.end(), one.first); });
    }
    targets_ = std::move(targets);
    read_all_again();
}

void Consoles::read_all_again() {
    for (const auto& [key, universe] : universes_) waiting_.universes.emplace(key, universe);
}

bool Consoles::anything_waits() const {
    return inputs_ != nullptr && (!waiting_.universes.empty() || inputs_->updates().waiting());
}

void Consoles::serve(RenderSession& render_session, std::int64_t now_ns) {
    if (inputs_ == nullptr) return;
    follow_patch(render_session.scene());
    if (retry_ns_ != 0 && now_ns >= retry_ns_) {
        retry_ns_ = 0;
        read_all_again();
    }
    if (!anything_waits() || now_ns - served_ns_ < interval_ns_) return;
    served_ns_ = now_ns;
    if (auto updates = inputs_->updates().try_take()) {
        for (auto& [key, universe] : updates->universes) waiting_.universes[key] = std::move(universe);
        waiting_.osc = std::move(updates->osc);
        if (updates->timecode)
            render_session.hear_timecode(TimecodeSource::artnet, updates->timecode->first, updates->timecode->second);
    }
    const Revision before = render_session.scene().scene_rev;
    apply_dmx(render_session, DmxProtocol::sacn, now_ns);
    apply_dmx(render_session, DmxProtocol::artnet, now_ns);
    apply_osc(render_session);
    render_session.tell_inputs(before);
    waiting_ = {};
}

// All universes of a protocol, as one command for each light.
void Consoles::apply_dmx(RenderSession& render_session, DmxProtocol protocol, std::int64_t now_ns) {
    values_.clear();
    for (const auto& [key, universe] : waiting_.universes) {
        if (key.protocol != protocol) continue;
        universes_[key] = universe;
        reader_.read(key, *universe, values_);
    }
    if (values_.empty()) return;
    for (std::optional<Error>& refused :
         render_session.apply_inputs(commands_of(render_session.scene(), values_), 0, Driven::by_console)) {
        if (!refused) continue;
        if (refused->code == "busy") {  // what else is refused cannot be until the console says something else
            reader_.forget(Property::profile);
            retry_ns_ = now_ns + kRetry_ns;
        }
        inputs_->tell_refusal(protocol, std::move(*refused));
    }
}

// One after the other: "red" fills up with what the message before it has set.
void Consoles::apply_osc(RenderSession& render_session) {
    std::vector<const std::pair<const std::string, InputUpdates::Osc>*> in_order;
    for (const auto& one : waiting_.osc) in_order.push_back(&one);
    std::sort(in_order.begin(), in_order.end(), [](auto* a, auto* b) { return a->second.order < b->second.order; });
    for (const auto* one : in_order) {
        const auto& [address, osc] = *one;
        const std::vector<v1::Command> commands = commands_of(render_session.scene(), osc.values);
        std::optional<Error> error;
        if (commands.empty()) error = Error{"not_found", address, "", "there is no light or group of this name"};
        for (std::optional<Error>& refused : render_session.apply_inputs(commands, 0, Driven::by_console))
            if (refused) error = std::move(refused);
        if (error) inputs_->tell_refusal(osc.from, address, std::move(*error));
    }
}

std::int64_t Consoles::sleep_ns(std::int64_t now_ns) const {
    constexpr std::int64_t kIdle_ns = 250'000'000;
    if (!anything_waits()) return kIdle_ns;
    return std::clamp<std::int64_t>(served_ns_ + interval_ns_ - now_ns, 0, kIdle_ns);
}

void Consoles::publish_state(const v1::State& state) {
    if (inputs_ != nullptr) inputs_->publish_state(state);
}

const v1::Sources& Consoles::sources() {
    if (inputs_ != nullptr)
        if (auto table = inputs_->table().try_take()) sources_ = std::move(*table);
    return sources_;
}

}  // namespace gonio

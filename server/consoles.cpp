#include "server/consoles.h"

#include <algorithm>

#include "server/scene/console.h"

namespace gonio {

// A change of the patch, of the scene or of its lights reads all universes anew.
void Consoles::follow_patch(const Scene& scene) {
    const std::array<Revision, 3> now = {scene.patch_rev, scene.geometry_rev, scene.lights_rev};
    if (patch_is_of_ == now) return;
    patch_is_of_ = now;
    const v1::Patch patch = patch_in_force(scene);
    reader_ = PatchReader(patch);
    const std::vector<DmxKey> wanted = universes_of(patch);
    inputs_->listen_to(wanted);
    std::erase_if(universes_,
                  [&](const auto& one) { return !std::binary_search(wanted.begin(), wanted.end(), one.first); });
    for (const auto& [key, universe] : universes_) waiting_.universes.emplace(key, universe);
}

void Consoles::serve(Stage& stage, std::int64_t now_ns) {
    if (inputs_ == nullptr) return;
    follow_patch(stage.scene());
    if (auto mail = inputs_->mail().try_take()) {
        for (auto& [key, universe] : mail->universes) waiting_.universes[key] = std::move(universe);
        for (auto& [address, osc] : mail->osc) waiting_.osc[address] = std::move(osc);
    }
    if ((waiting_.universes.empty() && waiting_.osc.empty()) || now_ns - served_ns_ < interval_ns_) return;
    served_ns_ = now_ns;
    std::vector<PropertyValue> values;
    for (const auto& [key, universe] : waiting_.universes) {
        universes_[key] = universe;
        for (PropertyValue& value : reader_.read(key, *universe)) values.push_back(std::move(value));
    }
    for (const v1::Command& command : commands_of(stage.scene(), values)) stage.apply_input(command);
    apply_osc(stage);
    stage.tell_inputs();
    waiting_ = {};
}

void Consoles::apply_osc(Stage& stage) {
    std::vector<const std::pair<const std::string, InputMail::Osc>*> in_order;
    for (const auto& one : waiting_.osc) in_order.push_back(&one);
    std::sort(in_order.begin(), in_order.end(), [](auto* a, auto* b) { return a->second.order < b->second.order; });
    for (const auto* one : in_order) {
        const auto& [address, osc] = *one;
        std::vector<std::size_t> unknown;
        std::optional<Error> error;
        for (const v1::Command& command : commands_of(stage.scene(), {&osc.value, 1}, &unknown))
            if (auto refused = stage.apply_input(command)) error = refused;
        if (!unknown.empty()) error = Error{"not_found", address, "", "there is no light or group of this name"};
        if (error) inputs_->tell_refusal(osc.from, address, *error);
    }
}

std::int64_t Consoles::sleep_ns(std::int64_t now_ns) const {
    constexpr std::int64_t kIdle_ns = 250'000'000;
    if (waiting_.universes.empty() && waiting_.osc.empty()) return kIdle_ns;
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

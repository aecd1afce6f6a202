#include "protocol/surface/surface_reader.h"

#include <algorithm>
#include <cmath>

#include "protocol/schema/surface.pb.h"
#include "protocol/surface/surface_map.h"

namespace gonio {
namespace {

constexpr double kSettled = 1e-4;  // of the range: smoothing ends on the goal itself

bool same(double a, double b, double range) {
    return std::abs(a - b) <= 1e-9 + 1e-6 * std::abs(range);
}

}  // namespace

SurfaceReader::SurfaceReader(std::span<const v1::SurfaceRow> rows, std::vector<std::string> lights)
    : lights_(std::move(lights)) {
    for (const v1::SurfaceRow& row : rows) {
        Row& added = rows_.emplace_back();
        added.row = row;
        added.property = find_property(row.property());
        if (added.property == nullptr) continue;
        added.low = row.has_low() ? row.low() : added.property->low;
        added.high = row.has_high() ? row.high() : added.property->high;
    }
    for (std::size_t i = 0; i < rows_.size(); ++i) by_control_[rows_[i].row.control()].push_back(i);
}

std::span<const std::size_t> SurfaceReader::rows_of(const std::string& control) const {
    const auto found = by_control_.find(control);
    return found == by_control_.end() ? std::span<const std::size_t>() : found->second;
}

void SurfaceReader::change_rows(std::span<const v1::SurfaceRow> rows) {
    std::map<std::string, Row*> known;
    for (Row& row : rows_) known.emplace(row.row.SerializeAsString(), &row);
    SurfaceReader fresh(rows, std::move(lights_));
    fresh.page_ = page_;
    for (Row& row : fresh.rows_) {
        const auto before = known.find(row.row.SerializeAsString());
        if (before == known.end()) continue;
        row = std::move(*before->second);
        known.erase(before);
        if (row.goal || row.speed != 0) ++fresh.moving_;
    }
    *this = std::move(fresh);
}

void SurfaceReader::rest(Row& row) {
    if (row.goal || row.speed != 0) --moving_;
    row.goal.reset();
    row.at.reset();
    row.speed = 0;
}

void SurfaceReader::attached(const std::string& device) {
    for (Row& row : rows_) {
        if (!means_box(row.row.device(), device)) continue;
        rest(row);
        row.taken = false;
        row.last.reset();
    }
}

void SurfaceReader::let_go(std::vector<SurfaceAction>& actions, bool pages_only) {
    for (Row& row : rows_) {
        if (pages_only && row.row.stride() == 0 && row.row.page() == 0) continue;
        if (row.before) set(row, *row.before, actions);
        row.before.reset();
        rest(row);
    }
}

void SurfaceReader::turn_to(std::uint32_t page) {
    page_ = std::clamp<std::uint32_t>(page, 1, kMaxSurfacePages);
    for (Row& row : rows_) {  // what the controls drive is another thing now: they have to be picked up
        if (row.row.stride() == 0 && row.row.page() == 0) continue;
        rest(row);
        row.taken = false;
        row.said.reset();
        row.before.reset();
        row.profile = SIZE_MAX;
        if (row.property != nullptr && row.property->of_buttons) row.last.reset();
    }
}

std::optional<std::string> SurfaceReader::target_of(const Row& row) const {
    const auto number = light_number(row.row.target());
    if (!number) return row.row.target();
    const std::uint32_t index = light_index(row.row, *number, page_);
    if (index >= lights_.size()) return std::nullopt;
    return lights_[index];
}

// The property as a share of the row's range, before the curve is undone; clamped.
std::optional<double> SurfaceReader::share_now(const Row& row, const ValueNow& now) const {
    const auto target = target_of(row);
    if (!target || row.property == nullptr || row.high == row.low) return std::nullopt;
    const auto value = now(*target, row.property->property);
    if (!value) return std::nullopt;
    return std::clamp((*value - row.low) / (row.high - row.low), 0.0, 1.0);
}

void SurfaceReader::set(Row& row, double share, std::vector<SurfaceAction>& actions) {
    const auto target = target_of(row);
    if (!target) return;
    SurfaceAction action;
    action.value.target = *target;
    action.value.property = row.property->property;
    const double value = row.low + (row.high - row.low) * share;
    if (row.property->by_list) {
        const auto count = static_cast<std::size_t>(row.row.profiles_size());
        const std::size_t index = std::min(count - 1, static_cast<std::size_t>(share * static_cast<double>(count)));
        if (index == row.profile) return;
        row.profile = index;
        action.value.name = row.row.profiles(static_cast<int>(index));
    } else if (row.property->of_buttons) {
        return;
    }
    action.value.value[0] = value;
    row.said = value;
    actions.push_back(std::move(action));
}

// At once, or smoothly from where the property is.
void SurfaceReader::aim_at(Row& row, double share, double tau_s, std::int64_t now_ns, const ValueNow& now,
                           std::vector<SurfaceAction>& actions) {
    if (tau_s <= 0 || row.property->by_name) {
        rest(row);
        return set(row, share, actions);
    }
    if (!row.goal) {
        const auto at = share_now(row, now);
        if (!at || std::abs(*at - share) <= kSettled) return set(row, share, actions);
        rest(row);
        row.at = at;
        row.stepped_ns = now_ns;
        ++moving_;
    }
    row.goal = share;
    row.tau_s = tau_s;
}

void SurfaceReader::take_absolute(Row& row, const ControlInput& input, std::int64_t now_ns, const ValueNow& now,
                                  std::vector<SurfaceAction>& actions) {
    const double v = std::clamp(input.value, 0.0, 1.0);
    const std::string& mode = row.row.mode();
    if (mode == "rate" || (mode.empty() && input.centred)) {
        const double deflection = 2 * v - 1;
        const double speed = std::abs(deflection) < kRateDeadband
                                 ? 0.0
                                 : deflection * (row.row.has_step() ? row.row.step() : kDefaultRate);
        if ((speed != 0) != (row.speed != 0)) {
            speed != 0 ? ++moving_ : --moving_;
            row.stepped_ns = now_ns;
        }
        row.speed = speed;
        return;
    }
    const auto share = share_now(row, now);
    const bool names = row.property->by_name;
    if (!share && !names) return;
    const bool pickup = row.row.takeover().empty() ? !input.motor : row.row.takeover() == "pickup";
    const std::optional<double> last = row.last;
    const double deadband = row.row.has_deadband_ratio() ? row.row.deadband_ratio() : input.deadband_ratio;
    if (last && row.taken && std::abs(v - *last) <= deadband && v > 0 && v < 1) return;
    row.last = v;
    if (pickup && !names) {
        const auto value = now(*target_of(row), row.property->property);
        const bool mine = row.taken && (!row.said || same(*value, *row.said, row.high - row.low));
        const bool moves_on = row.taken && now_ns - row.accepted_ns <= kSameMovement_ns;
        if (!mine && !moves_on) {
            const double at = position_of(row.row.curve(), *share);
            const bool near = std::abs(v - at) <= kPickupWithin;
            const bool crossed = last && (*last - at) * (v - at) <= 0;
            row.taken = last && (near || crossed);  // the first value only says where the control stands
            if (!row.taken) return;
            rest(row);
        }
    }
    row.taken = true;
    row.accepted_ns = now_ns;
    const double tau_s = row.row.has_smooth_s()                           ? row.row.smooth_s()
                         : input.steps <= kCoarseSteps && input.steps > 0 ? kDefaultSmooth_s
                                                                          : 0.0;
    aim_at(row, curve_of(row.row.curve(), v), tau_s, now_ns, now, actions);
}

void SurfaceReader::take_relative(Row& row, const ControlInput& input, std::int64_t now_ns, const ValueNow& now,
                                  std::vector<SurfaceAction>& actions) {
    const double step = row.row.has_step() ? row.row.step() : kDefaultClick;
    if (row.property->by_list) {
        const auto count = static_cast<double>(row.row.profiles_size());
        const double index =
            row.profile == SIZE_MAX ? 0 : static_cast<double>(row.profile) + (input.clicks > 0 ? 1 : -1);
        return set(row, (std::clamp(index, 0.0, count - 1) + 0.5) / count, actions);
    }
    const auto share = share_now(row, now);
    if (!share) return;
    const double from = position_of(row.row.curve(), row.goal ? *row.goal : *share);
    double to = from + input.clicks * step;
    if (row.property->property == Property::orbit) to -= std::floor(to);  // round and round
    const double tau_s = row.row.has_smooth_s() ? row.row.smooth_s() : kDefaultSmooth_s;
    const bool wraps = std::abs(to - (from + input.clicks * step)) > 0.5;
    aim_at(row, curve_of(row.row.curve(), std::clamp(to, 0.0, 1.0)), wraps ? 0 : tau_s, now_ns, now, actions);
}

void SurfaceReader::take_button(Row& row, const ControlInput& input, const ValueNow& now,
                                std::vector<SurfaceAction>& actions) {
    if (row.property == nullptr) {
        if (input.presses == 0) return;
        const auto turned =
            static_cast<std::int64_t>(page_) + static_cast<std::int64_t>(row.row.step()) * input.presses;
        let_go(actions, true);
        return turn_to(row.row.has_high() ? static_cast<std::uint32_t>(row.row.high())
                                          : static_cast<std::uint32_t>(std::max<std::int64_t>(1, turned)));
    }
    if (row.property->property == Property::preset) {
        if (input.presses == 0) return;
        SurfaceAction action;
        action.kind = row.row.mode() == "save" ? SurfaceAction::Kind::save_preset : SurfaceAction::Kind::set;
        action.value.property = Property::preset;
        action.value.name = row.row.preset();
        action.value.value[0] = row.row.fade_s();
        actions.push_back(std::move(action));
        return;
    }
    if (row.property->property == Property::cue) {
        for (unsigned i = 0; i < input.presses; ++i) {
            SurfaceAction action;
            action.kind = SurfaceAction::Kind::cue;
            action.value.property = Property::cue;
            action.value.name = row.row.cue();
            actions.push_back(std::move(action));
        }
        return;
    }
    if (row.property->by_list) {  // each press the next one
        for (unsigned i = 0; i < input.presses; ++i) {
            const auto count = static_cast<std::size_t>(row.row.profiles_size());
            const std::size_t next = row.profile == SIZE_MAX ? 0 : (row.profile + 1) % count;
            set(row, (static_cast<double>(next) + 0.5) / static_cast<double>(count), actions);
        }
        return;
    }
    if (row.row.mode() == "flash") {
        const auto share = share_now(row, now);
        if (input.presses > 0 && !row.before && share) {
            row.before = share;
            set(row, 1, actions);
        }
        if (input.value == 0 && row.before) {
            set(row, *row.before, actions);
            row.before.reset();
        }
        return;
    }
    if (input.presses == 0) return;
    if (row.row.mode() == "set") return set(row, 1, actions);
    const auto share = share_now(row, now);
    if (share && input.presses % 2 == 1) set(row, *share > 0.5 ? 0 : 1, actions);
}

ControlInput SurfaceReader::as_button(const Row& row, const ControlInput& input) {
    ControlInput button = input;
    button.kind = ControlKind::button;
    button.presses = input.kind == ControlKind::relative ? (input.clicks > 0 ? 1 : 0)
                                                         : (input.value >= 0.5 && row.last && *row.last < 0.5 ? 1 : 0);
    return button;
}

void SurfaceReader::take(const ControlInput& input, std::int64_t now_ns, const ValueNow& now,
                         std::vector<SurfaceAction>& actions) {
    for (const std::size_t i : rows_of(input.control)) {
        Row& row = rows_[i];
        if (!means_box(row.row.device(), input.device) || !on_page(row)) continue;
        if (input.kind == ControlKind::button) {
            take_button(row, input, now, actions);
        } else if (row.property != nullptr && row.property->of_buttons) {
            take_button(row, as_button(row, input), now, actions);
            row.last = input.value;
        } else if (row.property == nullptr) {
            continue;  // only buttons turn pages
        } else if (input.kind == ControlKind::relative) {
            take_relative(row, input, now_ns, now, actions);
        } else {
            take_absolute(row, input, now_ns, now, actions);
        }
    }
}

void SurfaceReader::step(std::int64_t now_ns, const ValueNow& now, std::vector<SurfaceAction>& actions) {
    for (Row& row : rows_) {
        if (!row.goal && row.speed == 0) continue;
        const double dt_s = std::max(0.0, static_cast<double>(now_ns - row.stepped_ns) * 1e-9);
        row.stepped_ns = now_ns;
        if (row.speed != 0) {
            const auto share = share_now(row, now);
            if (!share) continue;
            double to = *share + row.speed * dt_s;
            if (row.property->property == Property::orbit) to -= std::floor(to);
            to = std::clamp(to, 0.0, 1.0);
            if (to != *share) set(row, to, actions);
            continue;
        }
        // Somebody else has moved it: the hand has lost it.
        const auto target = target_of(row);
        const auto value = target ? now(*target, row.property->property) : std::nullopt;
        if (!value ||
            (row.said && !same(*value, *row.said, row.high - row.low) && now_ns - row.accepted_ns > kSameMovement_ns)) {
            rest(row);
            row.taken = false;
            continue;
        }
        *row.at += (*row.goal - *row.at) * (1.0 - std::exp(-dt_s / row.tau_s));
        const bool there = std::abs(*row.goal - *row.at) <= kSettled;
        const double share = there ? *row.goal : *row.at;
        if (there) rest(row);
        set(row, share, actions);
    }
}

std::optional<double> SurfaceReader::shown(const std::string& device, const std::string& control, const ValueNow& now,
                                           const std::string& recalled, const std::string& cue) const {
    for (const std::size_t i : rows_of(control)) {
        const Row& row = rows_[i];
        if (!means_box(row.row.device(), device) || !on_page(row)) continue;
        if (row.property == nullptr) return row.row.has_high() && row.row.high() == page_ ? 1.0 : 0.0;
        if (row.property->property == Property::preset) return row.row.preset() == recalled ? 1.0 : 0.0;
        if (row.property->property == Property::cue) return !cue.empty() && row.row.cue() == cue ? 1.0 : 0.0;
        if (row.property->by_list) return row.profile == SIZE_MAX ? 0.0 : 1.0;
        const auto share = share_now(row, now);
        if (!share) return 0.0;
        return position_of(row.row.curve(), *share);
    }
    return std::nullopt;
}

}  // namespace gonio

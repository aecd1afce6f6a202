// From what hands do on surfaces to values of the scene: soft takeover, curves, deadband, smoothing, pages. Pure: time
// and the scene's present values are parameters.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocol/schema/property.h"
#include "protocol/schema/surface.pb.h"
#include "protocol/surface/surface_profile.h"

namespace gonio {

// Within this of the present value a fader takes it over (Mixxx softtakeover.cpp: 3 of 128 steps) …
inline constexpr double kPickupWithin = 3.0 / 128;
// … and what follows an accepted value so soon is the same movement, however far it jumps.
inline constexpr std::int64_t kSameMovement_ns = 50'000'000;
inline constexpr double kDefaultSmooth_s = 0.025;  // of controls with at most kCoarseSteps
inline constexpr std::uint32_t kCoarseSteps = 255;
inline constexpr double kDefaultClick = 1.0 / 128;  // of the range for each click
inline constexpr double kDefaultRate = 0.5;         // of the range a second at full deflection
inline constexpr double kRateDeadband = 0.05;       // deflections below this are the middle

// The newest of one control since somebody looked.
struct ControlInput {
    std::string device, control;
    ControlKind kind = ControlKind::absolute;
    std::uint32_t steps = 0;
    bool centred = false, motor = false;
    double deadband_ratio = 0;
    double value = 0;      // absolute: 0..1; button: 0 or 1
    double clicks = 0;     // relative: the sum
    unsigned presses = 0;  // of a button, so that a short one is not lost
};

// What to do, in order. A value, or one of the surface's own doings.
struct SurfaceAction {
    enum class Kind : std::uint8_t { set, save_preset, cue } kind = Kind::set;
    PropertyValue value;  // of save_preset and cue: its name alone
};

// Asks the scene: the value of a property as it is now, SI; nothing where the target is not there.
using ValueNow = std::function<std::optional<double>(const std::string& target, Property property)>;

class SurfaceReader {
public:
    SurfaceReader() = default;
    // rows: checked; those that somebody set and those of profiles, which have their surface's identity as device.
    // lights: the scene's names in their order, which "#n" counts.
    SurfaceReader(std::span<const v1::SurfaceRow> rows, std::vector<std::string> lights);
    // Other rows: those that stay keep what the hand has of them, and the page stays.
    void change_rows(std::span<const v1::SurfaceRow> rows);
    // The scene's lights have changed.
    void name_lights(std::vector<std::string> lights) { lights_ = std::move(lights); }

    // A surface has come: where its controls stand is not known, they have to be picked up.
    void attached(const std::string& device);

    std::uint32_t page() const { return page_; }
    void turn_to(std::uint32_t page);
    // Lets go of what hands hold: flashed lights go back, speeds and smoothing end. pages_only: of controls that drive
    // something else on another page.
    void let_go(std::vector<SurfaceAction>& actions, bool pages_only = false);

    // Takes what one control says. Smoothed movements go on with step().
    void take(const ControlInput& input, std::int64_t now_ns, const ValueNow& now, std::vector<SurfaceAction>& actions);
    // What time brings: smoothing, and speeds of deflected controls.
    void step(std::int64_t now_ns, const ValueNow& now, std::vector<SurfaceAction>& actions);
    // Result: whether step() has more to do.
    bool moving() const { return moving_ > 0; }

    // Result: where the control stands for the scene as it is (0..1), to be shown on the surface: of a button 1 where
    // what it does is in force. Nothing for controls that drive nothing on this page. recalled: the preset in force;
    // cue: the number of the active one.
    std::optional<double> shown(const std::string& device, const std::string& control, const ValueNow& now,
                                const std::string& recalled, const std::string& cue = {}) const;

private:
    struct Row {
        v1::SurfaceRow row;
        const PropertyRow* property = nullptr;  // nullptr: pages
        double low = 0, high = 1;
        // State of the hand:
        std::optional<double> last;  // where the control stood
        bool taken = false;          // it has the value
        std::int64_t accepted_ns = 0;
        std::optional<double> said;    // the property as this row said it last
        std::optional<double> before;  // of "flash": what the button covers
        // Of smoothing (share of the range, after the curve) and of speeds:
        std::optional<double> goal, at;
        double tau_s = 0, speed = 0;
        std::int64_t stepped_ns = 0;
        std::size_t profile = SIZE_MAX;  // that was chosen last
    };
    std::optional<std::string> target_of(const Row& row) const;
    bool on_page(const Row& row) const { return row.row.page() == 0 || row.row.page() == page_; }
    void set(Row& row, double share, std::vector<SurfaceAction>& actions);
    void aim_at(Row& row, double share, double tau_s, std::int64_t now_ns, const ValueNow& now,
                std::vector<SurfaceAction>& actions);
    std::optional<double> share_now(const Row& row, const ValueNow& now) const;
    void take_absolute(Row& row, const ControlInput& input, std::int64_t now_ns, const ValueNow& now,
                       std::vector<SurfaceAction>& actions);
    void take_relative(Row& row, const ControlInput& input, std::int64_t now_ns, const ValueNow& now,
                       std::vector<SurfaceAction>& actions);
    void take_button(Row& row, const ControlInput& input, const ValueNow& now, std::vector<SurfaceAction>& actions);
    // Result: indices of a control's rows, on any page and surface.
    std::span<const std::size_t> rows_of(const std::string& control) const;
    // A fader or knob whose row is a preset: pushed up over the middle, or turned on, it is a press.
    static ControlInput as_button(const Row& row, const ControlInput& input);
    void rest(Row& row);

    std::vector<Row> rows_;
    std::map<std::string, std::vector<std::size_t>, std::less<>> by_control_;
    std::vector<std::string> lights_;
    std::uint32_t page_ = 1;
    unsigned moving_ = 0;  // rows with a goal or a speed
};

}  // namespace gonio

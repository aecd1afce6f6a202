#include "server/scene/apply_view.h"

#include <algorithm>
#include <cmath>

#include "protocol/schema/palette.h"
#include "protocol/schema/view.pb.h"
#include "server/scene/apply.h"
#include "server/scene/apply_checks.h"
#include "server/scene/false_color.h"
#include "server/scene/light_values.h"
#include "server/scene/scene.h"

namespace gonio {
namespace {

constexpr const char* kToneNames[] = {"knee", "linear", "aces", "agx", "neutral"};
constexpr double kAutoDecades = 1e4;  // from the end of an automatic logarithmic scale down to its beginning

// Result: "a, b, c": all of them.
template <typename Names, typename Text>
std::string listed(const Names& names, Text text) {
    std::string list;
    for (const auto& name : names) list += (list.empty() ? "" : ", ") + std::string(text(name));
    return list;
}

std::string view_names() {
    std::string names;
    for (int i = 0; i <= static_cast<int>(View::solid); ++i)
        names += (i == 0 ? "" : ", ") + std::string(view_name(static_cast<View>(i)));
    return names;
}

bool sets_false_color(const v1::SetView& set) {
    return set.has_range_low() || set.has_range_high() || set.has_range_auto() || set.has_scale() || set.has_steps() ||
           set.has_palette() || set.has_isolux() || set.has_below() || set.has_levels() || set.has_compare_range();
}

std::vector<double> checked_levels(const v1::Levels& given) {
    const auto& values = given.values();
    if (static_cast<std::size_t>(values.size()) > kMostGivenLevels)
        refuse("too_large", "set_view.levels", std::to_string(values.size()), "there are at most 16 levels");
    std::vector<double> levels;
    for (const double value : values) {
        if (!(value > 0.0)) refuse("invalid_argument", "set_view.levels", print_number(value), "must be above 0");
        levels.push_back(checked(value, 0.0, kMaxRange, "set_view.levels"));
    }
    std::ranges::sort(levels);
    levels.erase(std::unique(levels.begin(), levels.end()), levels.end());
    return levels;
}

void set_range(FalseColor& color, const v1::SetView& set) {
    if (set.has_scale()) {
        if (set.scale() != "log" && set.scale() != "linear")
            refuse("invalid_argument", "set_view.scale", set.scale(), "must be log or linear");
        color.logarithmic = set.scale() == "log";
    }
    if (set.has_range_low()) color.range_low = checked(set.range_low(), 0.0, kMaxRange, "set_view.range_low");
    if (set.has_range_high()) color.range_high = checked(set.range_high(), 0.0, kMaxRange, "set_view.range_high");
    if (set.has_range_auto())
        color.range_auto = set.range_auto();
    else if (set.has_range_low() || set.has_range_high())
        color.range_auto = false;
    if (color.range_auto) color.range_low = color.logarithmic ? color.range_high / kAutoDecades : 0.0;
    if (color.logarithmic && color.range_low < kMinLogRange)
        refuse("invalid_argument", "set_view.range_low", print_number(color.range_low),
               "must be at least 1e-6 on a logarithmic scale; a linear one may begin at 0");
    if (!(color.range_high > color.range_low * 1.000001))
        refuse("invalid_argument", "set_view.range_high", print_number(color.range_high),
               "must be above the lower end, " + print_number(color.range_low));
}

void set_false_color(Scene& scene, View view, const v1::SetView& set) {
    if (!is_false_color(view))
        refuse("invalid_argument", "set_view.view", view_name(view),
               "only illuminance and luminance have a scale of colours");
    FalseColor color = false_color_of(scene, view);
    set_range(color, set);
    if (set.has_steps()) {
        if (set.steps() == 1 || set.steps() > kMostSteps)
            refuse("invalid_argument", "set_view.steps", std::to_string(set.steps()), "must be 0 or from 2 to 27");
        color.steps = set.steps();
    }
    if (set.has_palette()) {
        if (find_palette(set.palette()) == nullptr)
            refuse("invalid_argument", "set_view.palette", set.palette(),
                   "must be one of " + listed(palettes(), [](const Palette& palette) { return palette.name; }));
        color.palette = set.palette();
    }
    if (set.has_levels()) {  // whoever gives levels wants to see them
        color.levels = checked_levels(set.levels());
        color.isolux = color.isolux || !color.levels.empty();
    }
    if (set.has_isolux()) color.isolux = set.isolux();
    if (set.has_below()) color.below = checked(set.below(), 0.0, kMaxRange, "set_view.below");
    if (set.has_compare_range())
        color.compare_range = checked(set.compare_range(), kMinLogRange, kMaxRange, "set_view.compare_range");
    change(scene, scene.false_color[view == View::luminance ? 1 : 0], color, scene.view_rev);
}

}  // namespace

void set_view(Scene& scene, const v1::SetView& set) {
    View view = scene.view;
    if (!set.view().empty() && !parse_view(set.view(), view))
        refuse("invalid_argument", "set_view.view", set.view(), "must be one of " + view_names());
    change(scene, scene.view, view, scene.view_rev);
    if (set.has_gain())
        change(scene, scene.view_gain, checked(set.gain(), 0.01, 1000.0, "set_view.gain"), scene.view_rev);
    const auto light = [&](const std::string& name, std::string& to, const char* field) {
        if (!name.empty() && find_light(scene, name) == nullptr)
            refuse("not_found", field, name, "there is no light of this name");
        change(scene, to, name, scene.view_rev);
    };
    if (set.has_light()) light(set.light(), scene.view_light, "set_view.light");
    if (set.has_only()) light(set.only(), scene.view_only, "set_view.only");
    if (set.has_compare()) {
        if (!set.compare().empty() && !scene.presets.contains(set.compare()))
            refuse_unknown("set_view.compare", set.compare(), "preset", scene.presets);
        change(scene, scene.view_compare, set.compare(), scene.view_rev);
        if (scene.view_rev > scene.scene_rev) scene.compare_rev = scene.view_rev;
    }
    if (set.has_work_light()) change(scene, scene.work_light, set.work_light(), scene.view_rev);
    if (sets_false_color(set)) set_false_color(scene, view, set);
}

std::string why_no_work_light(const Scene& scene) {
    if (!scene.work_light || work_light_on(scene)) return {};
    const std::string what = "the work light is on, but does not show: ";
    if (needs_work_light(scene)) return what + "the view " + view_name(scene.view) + " has none";
    if (!scene.lights.empty() && !scene.asset->instances.empty())
        return what + std::to_string(scene.lights.size()) +
               (scene.lights.size() == 1 ? " luminaire lights" : " luminaires light") + " the scene";
    return what + "surfaces of the scene give light";
}

void note_preset(Scene& scene, const std::string& name) {
    if (scene.view_compare != name) return;
    scene.view_rev = scene.compare_rev = scene.scene_rev + 1;
    if (!scene.presets.contains(name)) scene.view_compare.clear();
}

double ev100_of(double aperture, double shutter_s, double iso) {
    return std::log2(aperture * aperture / shutter_s * 100.0 / iso);
}

// Without a value of its own, automatic starts from the one that there is.
void set_exposure(Scene& scene, const v1::SetExposure& set) {
    const bool camera = set.has_aperture() || set.has_shutter_s() || set.has_iso();
    if (!set.has_ev100() && !set.has_automatic() && !camera) return;
    if (camera && set.has_ev100())
        refuse("conflict", "set_exposure.ev100", print_number(set.ev100()),
               "aperture, shutter_s and iso say what it is");
    // What is given is checked first: it is what was typed.
    const auto given = [](bool has, double value, double low, double high, const char* field) {
        return has ? checked(value, low, high, field) : 1.0;
    };
    const double aperture = given(set.has_aperture(), set.aperture(), 0.5, 128.0, "set_exposure.aperture"),
                 shutter_s = given(set.has_shutter_s(), set.shutter_s(), 1e-6, 3600.0, "set_exposure.shutter_s"),
                 iso = given(set.has_iso(), set.iso(), 1.0, 1e7, "set_exposure.iso");
    if (camera && !(set.has_aperture() && set.has_shutter_s() && set.has_iso()))
        refuse("invalid_argument",
               set.has_aperture() ? set.has_shutter_s() ? "set_exposure.iso" : "set_exposure.shutter_s"
                                  : "set_exposure.aperture",
               "", "aperture, shutter_s and iso go together");
    const PropertyRow& row = row_of(Property::exposure);
    if (camera) {
        const double ev100 = ev100_of(aperture, shutter_s, iso);
        if (!(ev100 >= row.least && ev100 <= row.most))
            refuse("invalid_argument", "set_exposure.shutter_s", print_number(set.shutter_s()),
                   "makes EV100 " + print_number(ev100) + ", which must be from " + print_number(row.least) + " to " +
                       print_number(row.most));
        change(scene, scene.exposure_ev100, ev100, scene.exposure_rev);
    }
    if (set.has_ev100())
        change(scene, scene.exposure_ev100, checked(set.ev100(), row.least, row.most, "set_exposure.ev100"),
               scene.exposure_rev);
    change(scene, scene.exposure_auto, set.automatic(), scene.exposure_rev);
}

void set_look(Scene& scene, const v1::SetLook& set) {
    Look look = scene.look;
    if (set.has_tone()) {
        const auto at = std::ranges::find(kToneNames, set.tone());
        if (at == std::end(kToneNames))
            refuse("invalid_argument", "set_look.tone", set.tone(),
                   "must be one of " + listed(kToneNames, [](const char* name) { return name; }));
        look.tone = static_cast<Tone>(at - std::begin(kToneNames));
    }
    if (set.has_white_k()) look.white_k = checked(set.white_k(), row_of(Property::cct), "set_look.white_k");
    if (set.has_white_duv()) look.white_duv = checked(set.white_duv(), row_of(Property::tint), "set_look.white_duv");
    change(scene, scene.look, look, scene.look_rev);
}

void put_look(const Look& look, v1::Look& out) {
    out.set_tone(kToneNames[static_cast<int>(look.tone)]);
    out.set_white_k(look.white_k);
    out.set_white_duv(look.white_duv);
}

}  // namespace gonio

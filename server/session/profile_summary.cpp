#include "server/session/profile_summary.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "ies/lamp_colour.h"
#include "ies/quantities.h"
#include "protocol/schema/library.pb.h"
#include "protocol/text/shortened_text.h"

namespace gonio {
namespace {

constexpr std::size_t kMaxDiagnostics = 32;
constexpr int kCurveStepDeg = 5;

double candela(const Profile& profile, double v_deg, double h_deg) {
    return ies::intensity(profile.photometry.web,
                          ies::direction_of(ies::Goniometer::type_c, Angle::degrees(v_deg), Angle::degrees(h_deg)))
        .in(cd);
}

// Result: manufacturer, catalogue number and luminaire, as far as the file tells them, parted by commas.
std::string description_of(const ies::Photometry& photometry) {
    std::vector<std::string> parts;
    if (const auto& eulumdat = photometry.eulumdat) {
        parts = {eulumdat->company, eulumdat->number, eulumdat->name};
    } else {
        for (const char* wanted : {"MANUFAC", "LUMCAT", "LUMINAIRE"})
            for (const auto& [key, value] : photometry.provenance.keywords)
                if (key == wanted) parts.push_back(value);
    }
    std::string text;
    for (const std::string& part : parts)
        if (!part.empty()) text += (text.empty() ? "" : ", ") + part;
    return shortened_text(text, 300);
}

// The angles that `gonio photometry` prints, without the quantities that take long.
void put_beams(const ies::Photometry& photometry, v1::PhotometrySummary& summary) {
    constexpr double kRight = std::numbers::pi / 2;
    const bool type_c = photometry.web.goniometer == ies::Goniometer::type_c;
    const double zero = photometry.provenance.zero_plane_rad;
    const ies::PlaneBeams first = plane_beams(photometry.web, Angle::radians(type_c ? zero : kRight)),
                          second = plane_beams(photometry.web, Angle::radians(type_c ? zero + kRight : 0.0));
    const ies::PlaneBeams& lit = first.beam.outermost ? first : second;
    if (lit.beam.outermost) summary.set_beam_rad(lit.beam.outermost->radians());
    if (lit.field.outermost) summary.set_field_rad(lit.field.outermost->radians());
    const auto beam = std::max(first.beam.outermost, second.beam.outermost),
               field = std::max(first.field.outermost, second.field.outermost);
    if (beam) summary.set_widest_beam_rad(beam->radians());
    if (field) summary.set_widest_field_rad(field->radians());
}

// What the file says of its colour, which no light takes on its own; empty where it says nothing.
std::string colour_note(const ies::Photometry& photometry) {
    const ies::LampColour colour = ies::lamp_colour(photometry);
    if (!colour.cct_k && !colour.cri) return {};
    std::string text = "note lamp_colour: the file says ";
    if (colour.cct_k) text += print_number(*colour.cct_k) + " K";
    if (colour.cri)
        text += (colour.cct_k ? ", " : "") + std::string(colour.cri_is_least ? "CRI at least " : "CRI ") +
                print_number(*colour.cri);
    if (colour.cct_k)
        text += "; a light is of this colour with gonio set light NAME --cct " + print_number(*colour.cct_k);
    return text;
}

}  // namespace

v1::PhotometrySummary summary_of(const Profile& profile) {
    const ies::Photometry& photometry = profile.photometry;
    v1::PhotometrySummary summary;
    summary.set_max_cd(profile.peak_cd);
    summary.set_flux_lm(profile.flux_lm);
    put_beams(photometry, summary);
    summary.set_input_watts(photometry.provenance.input_watts);
    summary.set_opening(ies::shape_name(photometry.opening.shape));
    summary.set_length_m(photometry.opening.length.in(m));
    summary.set_width_m(photometry.opening.width.in(m));
    summary.set_height_m(photometry.opening.height.in(m));
    summary.set_format(photometry.provenance.format);
    summary.set_description(description_of(photometry));
    summary.set_product(profile.product);
    if (const std::string note = colour_note(photometry); !note.empty()) summary.add_diagnostics(note);
    for (const ies::Diagnostic& d : photometry.diagnostics) {
        if (static_cast<std::size_t>(summary.diagnostics_size()) == kMaxDiagnostics) break;
        summary.add_diagnostics(d.severity + " " + d.code +
                                (d.line > 0 ? " (line " + std::to_string(d.line) + ")" : "") + ": " + d.message);
    }
    return summary;
}

std::string curve_of(const Profile& profile) {
    std::string curve;
    const double scale = profile.peak_cd > 0 ? 255.0 / profile.peak_cd : 0.0;
    for (const int h_deg : {0, 90, 180, 270})
        for (int v_deg = 0; v_deg <= 180; v_deg += kCurveStepDeg) {
            const double shown = std::clamp(std::round(candela(profile, v_deg, h_deg) * scale), 0.0, 255.0);
            curve.push_back(static_cast<char>(static_cast<unsigned char>(shown)));
        }
    return curve;
}

v1::ProfileReply profile_reply(const Light& light) {
    v1::ProfileReply reply;
    reply.set_light(light.name);
    reply.set_profile(light.profile->name);
    reply.set_max_cd(light.shining()->peak_cd);
    reply.set_flux_lm(light.shining()->flux_lm);
    for (int v = 0; v <= 180; v += 2) {
        reply.add_v_deg(v);
        reply.add_c0_cd(candela(*light.shining(), v, 0));
        reply.add_c90_cd(candela(*light.shining(), v, 90));
        reply.add_c180_cd(candela(*light.shining(), v, 180));
        reply.add_c270_cd(candela(*light.shining(), v, 270));
    }
    *reply.mutable_summary() = summary_of(*light.shining());
    reply.set_tilt_factor(light.tilt_factor);
    return reply;
}

}  // namespace gonio

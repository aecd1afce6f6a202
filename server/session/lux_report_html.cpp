// The page of a lux report.
#include <openssl/evp.h>

#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>

#include "ies/core/printed.h"
#include "ies/writers.h"
#include "protocol/schema/grid.pb.h"
#include "server/base/sha256.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "server/session/grid_plan.h"
#include "server/session/lux_report.h"

namespace gonio {
namespace {

constexpr const char* kStyle = R"(
@page { size: A4; margin: 16mm 15mm 18mm;
  @bottom-right { content: counter(page) " / " counter(pages); font: 8pt sans-serif; } }
body { font: 10pt/1.4 "Liberation Sans", Arial, sans-serif; color: #000; background: #fff; margin: 0 auto; max-width: 180mm; }
h1 { font-size: 18pt; margin: 0 0 2mm; } h2 { font-size: 13pt; margin: 8mm 0 2mm; } h3 { font-size: 11pt; margin: 5mm 0 1mm; }
h2, h3 { break-after: avoid; }
table { border-collapse: collapse; width: 100%; font-size: 8.5pt; } caption { text-align: left; padding: 1mm 0; }
th, td { border: 0.2mm solid #888; padding: 0.7mm 1.4mm; text-align: left; vertical-align: top; overflow-wrap: anywhere; }
td:first-child:not(.n) { min-width: 22mm; } td:nth-child(2):not(.n):not(:last-child) { min-width: 20mm; }
th { background: #eee; print-color-adjust: exact; -webkit-print-color-adjust: exact; } thead { display: table-header-group; }
td.n, th.n { text-align: right; white-space: nowrap; } tr, figure, .grid, .sign { break-inside: avoid; }
figure { margin: 0 0 4mm; } figure img { width: 100%; height: auto; max-height: 115mm; object-fit: contain; }
figcaption, .note { font-size: 8.5pt; color: #333; } .hash { font: 7pt monospace; }
.plan svg { max-width: 100%; height: auto; max-height: 210mm; } .fail { font-weight: bold; }
.sign { margin-top: 14mm; display: flex; gap: 8mm; } .sign div { flex: 1; border-top: 0.3mm solid #000; padding-top: 1mm; }
)";

std::string base64(const std::string& bytes) {
    std::string text(4 * ((bytes.size() + 2) / 3) + 1, '\0');  // EVP_EncodeBlock ends it with a zero
    const int written =
        EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()),
                        reinterpret_cast<const unsigned char*>(bytes.data()), static_cast<int>(bytes.size()));
    text.resize(static_cast<std::size_t>(written));
    return text;
}

std::string cell(const std::string& text) {
    return "<td>" + text + "</td>";
}
std::string number_cell(const std::string& text) {
    return "<td class=\"n\">" + text + "</td>";
}
// Result: the head of a table; names with a leading # are of numbers.
std::string head(std::initializer_list<std::string_view> names) {
    std::string text = "<thead><tr>";
    for (const std::string_view name : names)
        text += name.starts_with('#') ? "<th class=\"n\">" + std::string(name.substr(1)) + "</th>"
                                      : "<th>" + std::string(name) + "</th>";
    return text + "</tr></thead>";
}

std::string check_text(const google::protobuf::RepeatedPtrField<v1::TargetCheck>& checks) {
    std::string text;
    for (const v1::TargetCheck& check : checks) {
        const bool most = check.name() == "UGR";
        text += (text.empty() ? "" : "<br>") +
                std::string(check.passed() ? "<span>✓ pass: " : "<span class=\"fail\">✗ FAIL: ") +
                escaped(check.name()) +
                printed(" %.*f, required %s %.*f",
                        check.name() == "U0" ? 2
                        : most               ? 1
                                             : 0,
                        check.reached(), most ? "≤" : "≥", check.name() == "U0" ? 2 : 0, check.required()) +
                "</span>";
    }
    return text.empty() ? "no target" : text;
}

std::string target_text(const v1::Target& target) {
    std::string text = escaped(target.name());
    if (!target.task().empty()) text += (text.empty() ? "" : ": ") + escaped(target.task());
    if (!target.edition().empty()) text += " (" + escaped(target.edition()) + ")";
    return text.empty() ? "–" : text;
}

std::string pictures_html(const LuxReportParts& parts) {
    std::string text;
    for (const LuxReportParts::Picture& picture : parts.pictures) {
        const std::string name =
            picture.view == View::illuminance ? "Illuminance in false colours, lx" : "The camera's view";
        text += "<figure><img alt=\"" + name + "\" src=\"data:" + picture.type + ";base64," + base64(picture.image) +
                "\"><figcaption>" + name + printed("; %u paths per pixel, noise ", picture.samples) +
                (picture.samples < trace::kLeastPassesOfNoise ? std::string("not known")
                                                              : printed("%.2g %%", 100.0 * picture.noise)) +
                (picture.view == View::beauty ? ", filtered: to look at, not to measure" : "") +
                (picture.noise_reached ? "" : "; ended by its time, before its noise") + ".</figcaption></figure>";
    }
    return text;
}

std::string results_html(const LuxReportParts& parts) {
    if (parts.grids.empty()) return "<p>The show has no calculation grid.</p>";
    std::string text = "<table>" +
                       head({"grid", "quantity", "#mean lx", "#min lx", "#max lx", "#U0", "#Ud", "target", "result"}) +
                       "<tbody>";
    for (const v1::GridValues& values : parts.grids)
        text += "<tr>" + cell(escaped(values.grid().name())) + cell(escaped(values.grid().quantity())) +
                number_cell(printed("%.1f", values.mean_lx())) + number_cell(printed("%.1f", values.min_lx())) +
                number_cell(printed("%.1f", values.max_lx())) +
                number_cell(printed("%.2f", values.uniformity_ratio())) +
                number_cell(printed("%.2f", values.diversity_ratio())) + cell(target_text(values.grid().target())) +
                cell(check_text(values.checks())) + "</tr>";
    return text + "</tbody></table>";
}

std::string grid_html(const v1::GridValues& values) {
    const v1::Grid& grid = values.grid();
    std::string text = "<div class=\"grid\"><h3>" + escaped(grid.name()) + "</h3><p class=\"note\">" +
                       escaped(grid.quantity()) + " illuminance in lx; " +
                       printed("%u × %u points at the centres of cells of %.3f m × %.3f m; ", values.count(0),
                               values.count(1), values.cell_m(0), values.cell_m(1)) +
                       (grid.count_size() > 0 ? std::string("numbers of points given")
                                              : "numbers of points by p = 0.2 · 5<sup>log10 d</sup>, rounded " +
                                                    std::string(grid.spacing() == "up" ? "up" : "to the nearest")) +
                       printed("; corner %.3f, %.3f, %.3f m", grid.corner_m(0), grid.corner_m(1), grid.corner_m(2)) +
                       printed("; %.2f m along the edges left out; maintenance factor %.3g", grid.margin_m(),
                               grid.maintenance_factor());
    if (grid.direction_size() == 3)
        text += printed("; direction %.3g, %.3g, %.3g", grid.direction(0), grid.direction(1), grid.direction(2));
    if (!grid.view().empty()) text += "; camera of the view " + escaped(grid.view());
    if (values.has_error_lx()) text += printed("; standard error %.2g lx", values.error_lx());
    if (values.has_noise_reached() && !values.noise_reached()) text += " (ended by its time, before its noise)";
    if (const std::string left_out = left_out_text(values); !left_out.empty()) text += "; " + left_out + ", dashes";
    for (const std::string& warning : values.warnings()) text += "; " + escaped(warning);
    return text +
           ". The least value is framed with dashes, the greatest with a line; crossed circles are luminaires.</p>"
           "<div class=\"plan\">" +
           values.plan_svg() + "</div></div>";
}

std::string observer_html(const v1::Ugr& ugr) {
    const v1::Observer& observer = ugr.observer();
    std::string text =
        "<div class=\"grid\"><h3>" + escaped(observer.name()) + "</h3><p>" +
        (ugr.has_ugr() ? printed("<b>UGR %.1f</b>. ", ugr.ugr())
                       : std::string("<b>No UGR</b>: nothing glares, or no light is indirect. ")) +
        check_text(ugr.checks()) + "; target: " + target_text(observer.target()) + "</p><p class=\"note\">" +
        printed("Eye %.3f, %.3f, %.3f m; ", observer.eye_m(0), observer.eye_m(1), observer.eye_m(2)) +
        printed("line of sight %.3g, %.3g, %.3g; ", observer.direction(0), observer.direction(1),
                observer.direction(2)) +
        printed("background %.4g cd/m²; indirect %.4g lx on the plane at the eye, standard error %.2g lx.",
                ugr.background_nit(), ugr.indirect_lx(), ugr.indirect_error_lx());
    for (const std::string& warning : ugr.warnings()) text += " Note: " + escaped(warning) + ".";
    text += "</p>";
    if (ugr.sources_size() == 0) return text + "</div>";
    text += "<table>" + head({"luminaire", "#m", "#L cd/m²", "#ω sr", "#p", "#L²ω/p²", "left out"}) + "<tbody>";
    for (const v1::GlareSource& source : ugr.sources()) {
        const bool counts = source.left_out().empty();
        text += "<tr>" + cell(escaped(source.light())) + number_cell(printed("%.2f", source.distance_m())) +
                number_cell(counts ? printed("%.0f", source.luminance_nit()) : "–") +
                number_cell(counts ? printed("%.6f", source.solid_angle_sr()) : "–") +
                number_cell(counts ? printed("%.3f", source.position_index()) : "–") +
                number_cell(counts ? printed("%.4g", source.term()) : "–") + cell(escaped(source.left_out())) + "</tr>";
    }
    return text + "</tbody></table></div>";
}

std::string colour_text(const Light& light) {
    std::string text = light.cct_k > 0 ? printed("%.0f K", light.cct_k) : std::string("as in the file");
    if (light.tint_duv != 0) text += printed(", Duv %.4f", light.tint_duv);
    if (light.gel) text += ", gel " + escaped(light.gel->name);
    if (light.color != glm::dvec3(1.0))
        text += printed(", rgb %.3g %.3g %.3g", light.color.r, light.color.g, light.color.b);
    return text;
}

std::string luminaires_html(const Scene& scene) {
    if (scene.lights.empty()) return "<p>The scene has no luminaire.</p>";
    std::map<const Profile*, int> number_of;  // of a photometric file, from 1
    std::vector<const Profile*> profiles;
    std::string rows;
    for (const Light& light : scene.lights) {
        const auto [entry, fresh] = number_of.try_emplace(light.shining().get(), static_cast<int>(profiles.size()) + 1);
        if (fresh && !light.sun) profiles.push_back(light.shining().get());
        const glm::dvec3 aim = light.world_from_light * glm::dvec3(0, 0, -1);
        rows += "<tr>" + cell(escaped(light.name)) + number_cell(light.sun ? "sun" : std::to_string(entry->second)) +
                number_cell(printed("%.1f %%", 100.0 * light.level_ratio * light.shutter_ratio)) +
                number_cell(printed("%.4g", light.multiplier)) +
                number_cell(light.sun ? "–"
                            : light.missing
                                ? "missing"
                                : printed("%.0f", light.shining()->flux_lm * light.multiplier * light.level_ratio *
                                                      light.shutter_ratio * scene.master_ratio * light.tilt_factor)) +
                cell(printed("%.3f, %.3f, %.3f", light.position.x, light.position.y, light.position.z)) +
                cell(printed("%.3f, %.3f, %.3f", aim.x, aim.y, aim.z)) + cell(colour_text(light)) + "</tr>";
        if (fresh && light.sun) number_of.erase(entry);
    }
    std::string text =
        "<table>" + head({"luminaire", "#file", "#level", "#multiplier", "#lm now", "position m", "aim", "colour"}) +
        "<tbody>" + rows + "</tbody></table><p class=\"note\">lm now: flux of the file × multiplier × level × master" +
        printed(" (%.1f %%), before colour and gel.</p>", 100.0 * scene.master_ratio) +
        "<table><caption>Photometric files</caption>" +
        head({"#file", "name", "#flux lm", "#max cd", "#W", "format", "SHA-256 of the data as LM-63-2019 text"}) +
        "<tbody>";
    for (std::size_t i = 0; i < profiles.size(); ++i) {
        const Profile& profile = *profiles[i];
        const double watts = profile.photometry.provenance.input_watts;
        text += "<tr>" + number_cell(std::to_string(i + 1)) + cell(escaped(profile.name)) +
                number_cell(printed("%.0f", profile.flux_lm)) + number_cell(printed("%.0f", profile.peak_cd)) +
                number_cell(watts > 0 ? printed("%.4g", watts) : "–") +
                cell(escaped(profile.photometry.provenance.format)) + "<td class=\"hash\">" +
                sha256(ies::write_lm63(profile.photometry)) + "</td></tr>";
    }
    return text + "</tbody></table>";
}

std::string method_html(const Scene& scene, const LuxReportRequest& request) {
    const trace::Settings& settings = request.pictures.front().settings;
    const std::string bounces = settings.bounces == trace::kAllBounces ? "all" : std::to_string(settings.bounces);
    double meter_noise = 0.0;
    for (const MeterRequest& meter : request.meters) meter_noise = meter.settings.noise;
    std::string text =
        "<ul><li>Technique: quality reference, path tracing with exact visibility; diffuse bounces: " + bounces +
        ".</li><li>Stated errors are standard errors of the sampling";
    if (meter_noise > 0)
        text += printed("; each point of a grid and each observer was computed to %.3g %% of its value",
                        100.0 * meter_noise);
    text +=
        ".</li><li>Luminaires emit from points with the intensities of their files; surfaces reflect diffusely.</li>"
        "<li>Grids: values are those of cell centres, times the maintenance factor. U0 = minimum / mean, Ud = minimum "
        "/ maximum. "
        "Spacing p = 0.2 · 5<sup>log10 d</sup> m (EN 12464-1), d the longer side, the shorter one where they differ by "
        "a factor of 2.</li>"
        "<li>Cylindrical illuminance is integrated over all azimuths; cylindrical-4 is the mean of four readings.</li>"
        "<li>UGR after CIE 117, new condition (maintenance factor 1): L from intensity and projected luminous opening, "
        "Guth's "
        "position index by bilinear interpolation, background from indirect light alone.</li>";
    text += "<li>Scene: " + escaped(scene.asset->name) +
            printed(", %zu triangles, revision %u, state of ", scene.asset->triangles(), scene.scene_rev) +
            escaped(request.date) +
            ". Exposure of the picture: " + printed("EV100 %.2f.</li></ul>", scene.exposure_ev100);
    return text;
}

}  // namespace

std::string lux_report_html(const Scene& scene, const LuxReportRequest& request, const LuxReportParts& parts) {
    std::string page =
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
        "content=\"width=device-width\"><title>" +
        escaped(request.title) + " – lux report</title><style>" + kStyle + "</style></head><body>\n<h1>" +
        escaped(request.title) + "</h1><p>Lux report. Scene " + escaped(scene.asset->name);
    if (!scene.show_name.empty()) page += ", show " + escaped(scene.show_name);
    page += printed(", revision %u, ", scene.scene_rev) + escaped(request.date) + "</p>\n";
    page += pictures_html(parts);
    page += "<h2>Results</h2>" + results_html(parts);
    if (!parts.grids.empty()) page += "<h2>Calculation grids</h2>";
    for (const v1::GridValues& values : parts.grids) page += grid_html(values);
    if (!parts.observers.empty()) page += "<h2>Glare</h2>";
    for (const v1::Ugr& ugr : parts.observers) page += observer_html(ugr);
    page += "<h2>Luminaires</h2>" + luminaires_html(scene);
    page += "<h2>How it was computed</h2>" + method_html(scene, request);
    page += "<div class=\"sign\"><div>Place, date</div><div>Name</div><div>Signature</div></div>\n</body></html>\n";
    return page;
}

}  // namespace gonio

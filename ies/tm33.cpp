#include "ies/tm33.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <pugixml.hpp>

#include "ies/core/text.h"
#include "ies/plausible.h"
#include "ies/text_encoding.h"
#include "ies/text_scan.h"
#include "ies/tm33_parts.h"
#include "ies/xml_text.h"

namespace gonio::ies {

namespace {

using detail::child_of;
using detail::error_at;
using detail::is_true;
using detail::offset_of;
using detail::Report;
using detail::text_of;
using detail::Tm33Document;
using pugi::xml_node;
using OptionalError = std::optional<Error>;

constexpr double kFluxTolerance = 0.03;             // between LuminousFlux and what the intensities give
constexpr const char* kUnknownDate = "1970-01-01";  // of write_tm33
constexpr std::size_t kListedEmitters = 8;          // by the note `emitters`

// Where an emitter's intensities stand: LuminousData/LuminousIntensity/IntData in the schema; eulumdat-rs has
// LuminousData/IntensityData or IntensityDistribution/IntensityData. RadiantData is taken where nothing else is there.
struct Intensities {
    xml_node element;
    bool radiant = false;
};

Intensities intensities_of(const xml_node& emitter) {
    if (const xml_node data = emitter.child("LuminousData")) {
        const xml_node inner = data.child("LuminousIntensity");
        return {inner.child("IntData") || inner.child("IntensityData") ? inner : data};
    }
    if (const xml_node data = emitter.child("IntensityDistribution"))
        return {data, detail::to_upper(text_of(data.child("Metric"))) == "RADIANT"};
    if (const xml_node data = emitter.child("RadiantData").child("RadiantIntensity")) return {data, true};
    return {};
}

std::string name_of(const xml_node& emitter, std::size_t number) {
    const xml_node name = child_of(emitter, {"Description", "CatalogNumber", "ID", "Id"});
    return std::to_string(number) + (text_of(name).empty() ? "" : " " + shown_text(text_of(name), 60));
}

bool is_called(const xml_node& emitter, std::size_t number, const std::string& wanted) {
    if (std::to_string(number) == wanted) return true;
    return std::ranges::any_of(std::array{"Description", "CatalogNumber", "ID", "Id"},
                               [&](const char* name) { return text_of(emitter.child(name)) == wanted; });
}

// Result: the emitter that is wanted, else the first one with intensities.
Result<xml_node> choose_emitter(const Tm33Document& document, const xml_node& root, const Choice& choice) {
    xml_node chosen;
    std::string names;
    std::size_t count = 0;
    for (const xml_node& emitter : root.children("Emitter")) {
        ++count;
        const bool wanted =
            choice.emitter.empty() ? bool(intensities_of(emitter).element) : is_called(emitter, count, choice.emitter);
        if (!chosen && wanted) chosen = emitter;
        if (count <= kListedEmitters) names += (count > 1 ? ", " : "") + name_of(emitter, count);
    }
    if (count > kListedEmitters) names += ", …";
    if (count == 0) return error_at(document.text, offset_of(root), "no_emitter", {}, "the file has no Emitter");
    if (!chosen && !choice.emitter.empty())
        return error_at(document.text, offset_of(root), "no_such_emitter", choice.emitter,
                        "the file has no such emitter; it has " + names);
    if (!chosen || !intensities_of(chosen).element)
        return error_at(document.text, offset_of(chosen ? chosen : root.child("Emitter")), "no_luminous_data", {},
                        "the emitter has no luminous intensities");
    if (count > 1)
        document.report.note("emitters", offset_of(chosen),
                             (choice.emitter.empty() ? "one of several emitters is taken, the first: "
                                                     : "one of several emitters is taken: ") +
                                 names);
    return chosen;
}

OptionalError read_tilt(const Tm33Document& document, const xml_node& emitter, std::optional<TiltTable>& result) {
    const xml_node element = emitter.child("TiltAngles");
    TiltTable table;
    for (const xml_node& tilt : element.children("Tilt")) {
        if (table.factor.size() == kMaxTiltPairs)
            return error_at(document.text, offset_of(tilt), "tilt_too_long", {}, "more than 10000 tilt angles");
        double angle = 0.0;
        double factor = 0.0;
        if (auto error = detail::read_number(document.text, tilt, tilt.attribute("angle").value(), "angle", angle))
            return error;
        if (auto error = detail::read_number(document.text, tilt, text_of(tilt), "Tilt", factor)) return error;
        const double radians = Angle::degrees(angle).radians();
        if (!table.angle_rad.empty() && !(radians > table.angle_rad.back()))
            return error_at(document.text, offset_of(tilt), "tilt_angles_not_ascending", print_number(angle),
                            "the tilt angles do not ascend");
        if (factor < 0.0)
            document.report.warn("negative_tilt_factor", offset_of(tilt), "a tilt factor is negative; 0 is used");
        table.angle_rad.push_back(radians);
        table.factor.push_back(std::max(factor, 0.0));
    }
    if (table.factor.empty()) return std::nullopt;
    document.report.note("tilt_table", offset_of(element),
                         "the candela change with the luminaire's tilt by the table in the file");
    result = std::move(table);
    return std::nullopt;
}

struct Keyword {
    const char* element;
    const char* key;
};
constexpr Keyword kHeader[] = {{"Manufacturer", "MANUFAC"},
                               {"CatalogNumber", "LUMCAT"},
                               {"Description", "LUMINAIRE"},
                               {"Laboratory", "TESTLAB"},
                               {"ReportNumber", "TEST"},
                               {"ReportDate", "ISSUEDATE"},
                               {"GTIN", "_GTIN"},
                               {"DocumentCreator", "_DOCUMENTCREATOR"},
                               {"DocumentCreationDate", "_DOCUMENTDATE"},
                               {"UniqueIdentifier", "_UNIQUEIDENTIFIER"},
                               {"MoreInfoURI", "_MOREINFOURI"},
                               {"Comment", "OTHER"},
                               {"Comments", "OTHER"},
                               {"Reference", "_REFERENCE"}};

// A comment "[KEY] text" is a keyword of LM-63, as write_tm33 keeps those that have no element of their own.
void add_header(const char* key, std::string_view text, std::vector<std::pair<std::string, std::string>>& keywords) {
    const std::size_t end = text.find("] ");
    const bool keyed = std::string_view(key) == "OTHER" && text.starts_with('[') && end != std::string_view::npos;
    if (!keyed) {
        keywords.emplace_back(key, text);
        return;
    }
    const std::string_view name = text.substr(1, end - 1);
    const auto date = std::ranges::find(keywords, std::pair<std::string, std::string>("ISSUEDATE", kUnknownDate));
    if (name == "ISSUEDATE" && date != keywords.end()) {
        date->second = text.substr(end + 2);
    } else {
        keywords.emplace_back(name, text.substr(end + 2));
    }
}

void read_keywords(const xml_node& root, const xml_node& emitter, Report& report, Provenance& provenance) {
    constexpr std::size_t kMaxKeywords = 10'000;
    auto& keywords = provenance.keywords;
    for (const xml_node& element : root.child("Header").children()) {
        for (const auto& [name, key] : kHeader) {
            if (element.name() != std::string_view(name) || text_of(element).empty()) continue;
            if (keywords.size() == kMaxKeywords) {
                report.warn("too_many_keywords", offset_of(element), "more than 10000 entries; the rest is ignored");
                return;
            }
            add_header(key, text_of(element), keywords);
        }
    }
    const auto add = [&](const char* key, const xml_node& element) {
        if (!text_of(element).empty()) keywords.emplace_back(key, text_of(element));
    };
    add("LAMP", emitter.child("Description"));
    add("LAMPCAT", emitter.child("CatalogNumber"));
    const xml_node colour = emitter.child("ColorTemperature").child("FixedCCT");
    const xml_node measured = emitter.child("LuminousData").child("MeasuredCCT");
    add("_COLORTEMP", colour ? colour : measured ? measured : emitter.child("CCT"));
    const xml_node rendering = emitter.child("ColorRendering");
    add("_CRI", (rendering.child("CIE_CRI") ? rendering.child("CIE_CRI") : rendering).child("Ra"));
    add("_DUV", emitter.child("Duv"));
}

OptionalError read_provenance(const Tm33Document& document, const xml_node& root, const xml_node& emitter,
                              const Intensities& intensities, Provenance& p) {
    const xml_node& data = intensities.element;
    const std::string_view text = document.text;
    p.format = root.name() == std::string_view("IESTM33")      ? "TM-33-18"
               : root.name() == std::string_view("IESTM33-22") ? "TM-33-22"
                                                               : "TM-33 (ATLA S001)";
    double quantity = 1.0;
    double rated = 0.0;
    if (auto error = detail::optional_number(document.text, emitter, {"Quantity"}, quantity)) return error;
    if (auto error = detail::optional_number(document.text, emitter, {"RatedLumens"}, rated)) return error;
    if (auto error = detail::optional_number(document.text, emitter, {"InputWattage", "InputWatts"}, p.input_watts))
        return error;
    if (auto error = detail::optional_number(document.text, emitter, {"BallastFactor"}, p.ballast_factor)) return error;
    if (auto error = detail::optional_number(document.text, data, {"Multiplier"}, p.multiplier)) return error;
    p.lamps = static_cast<int>(std::clamp(quantity, -1e9, 1e9));
    const xml_node absolute = child_of(data, {"AbsolutePhotometry", "Absolute"});
    p.absolute = absolute ? is_true(absolute) : !(document.other_names && rated > 0.0);
    p.scale = p.multiplier;
    if (quantity > 1.0)
        document.report.note("quantity", offset_of(emitter), "the intensities are taken as those of all emitters");
    if (p.absolute) {
        p.lumens_per_lamp = -1.0;
        if (p.ballast_factor != 1.0)
            document.report.warn("ballast_factor", offset_of(emitter),
                                 "the photometry is absolute: the ballast factor is not applied");
        p.ballast_factor = 1.0;
    } else {
        p.scale *= p.ballast_factor;
        p.rated_lumens = document.other_names ? rated : rated * std::max(1.0, quantity);
        p.lumens_per_lamp = p.rated_lumens / std::max(1, p.lamps);
        if (!(rated > 0.0)) {
            document.report.warn("zero_lumens", offset_of(emitter),
                                 "the photometry is relative without rated lumens; the candela are taken as absolute");
            p.rated_lumens = 0.0;
            p.lumens_per_lamp = -1.0;
            p.absolute = true;
        } else if (document.other_names) {
            p.scale *= rated / 1000.0;
            document.report.note("relative_base", offset_of(data),
                                 "the intensities are taken as candela per kilolumen");
        } else {
            document.report.note("relative_base", offset_of(data),
                                 "the intensities are taken as candela at the rated lumens");
        }
    }
    if (!(p.scale > 0.0))
        document.report.warn("scale_not_positive", offset_of(data),
                             "multiplier times ballast factor is not positive: it is dark");
    if (!std::isfinite(p.scale) || !std::isfinite(p.rated_lumens))
        return error_at(text, offset_of(data), "not_finite", {}, "the multiplier or the rated lumens are not finite");
    if (p.input_watts <= 0.0) document.report.note("no_watts", offset_of(emitter), "the input watts are not positive");
    return std::nullopt;
}

OptionalError compare_flux(const Tm33Document& document, const xml_node& emitter, LuminousFlux total) {
    const xml_node element = child_of(emitter.child("LuminousData"), {"LuminousFlux"});
    double stated = 0.0;
    if (!element) return std::nullopt;
    if (auto error = detail::read_number(document.text, element, text_of(element), "LuminousFlux", stated))
        return error;
    if (std::abs(stated - total.in(lm)) > kFluxTolerance * std::abs(stated))
        document.report.warn("flux_mismatch", offset_of(element),
                             "the luminous flux of the file is not what its intensities give");
    return std::nullopt;
}

}  // namespace

Result<Photometry> read_tm33(std::string_view bytes, const Choice& choice) {
    if (bytes.size() > kMaxFileBytes)
        return Error{"too_large", "byte " + std::to_string(kMaxFileBytes), std::to_string(bytes.size()),
                     "the file is larger than 64 MiB"};
    const std::string text = detail::xml_as_utf8(bytes);
    pugi::xml_document xml;
    if (auto error = detail::parse_xml(text, xml)) return *error;
    const xml_node root = xml.document_element();
    const std::string_view name = root.name();
    const bool other_root = name == "LuminaireOpticalData";
    if (!other_root && name != "IESTM33" && name != "IESTM33-22")
        return error_at(text, offset_of(root), "unknown_root", name,
                        "the root element is none of IESTM33, IESTM33-22 and LuminaireOpticalData");
    Report report(text);
    Tm33Document document{text, report, other_root};
    if (!choice.variant.empty())
        return error_at(text, offset_of(root), "no_such_variant", choice.variant, "the file has no variants");
    const auto emitter = choose_emitter(document, root, choice);
    if (!emitter) return emitter.error();
    const Intensities intensities = intensities_of(*emitter);
    document.other_names = other_root || intensities.element.child("IntensityData");
    if (document.other_names)
        report.note("other_names", offset_of(intensities.element),
                    "the element names are eulumdat-rs', not the schema's");

    Photometry result;
    if (auto error = read_provenance(document, root, *emitter, intensities, result.provenance)) return *error;
    read_keywords(root, *emitter, report, result.provenance);
    if (auto error = read_tilt(document, *emitter, result.tilt)) return *error;
    if (auto error = detail::read_tm33_opening(document, root, *emitter, result.opening)) return *error;
    if (auto error = detail::read_tm33_web(document, root, intensities.element, result)) return *error;
    const LuminousFlux total = total_flux(result.web);
    if (auto error = compare_flux(document, *emitter, total)) return *error;
    detail::check_plausible(result, total, offset_of(*emitter), report);
    if (intensities.radiant) {
        result.provenance.radiometric = true;
        report.warn("radiometric", offset_of(intensities.element),
                    "the intensities are radiant, in W/sr: they are no candela, and no lumens or lux come of them");
    }
    result.diagnostics = report.take();
    return result;
}

}  // namespace gonio::ies

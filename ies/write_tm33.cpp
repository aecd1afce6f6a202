#include <algorithm>
#include <array>
#include <cmath>

#include "ies/fold.h"
#include "ies/text_scan.h"
#include "ies/writers.h"

namespace gonio::ies {

namespace {

using Keywords = std::vector<std::pair<std::string, std::string>>;

// An xs:decimal: no exponent, no infinity.
std::string decimal(double value) {
    if (!std::isfinite(value)) return "0";
    char text[400];
    return {text, std::to_chars(text, text + sizeof text, value, std::chars_format::fixed).ptr};
}

std::string escaped(std::string_view text) {
    std::string result;
    for (const char c : detail::trim(text)) {
        switch (c) {
            case '<':
                result += "&lt;";
                break;
            case '>':
                result += "&gt;";
                break;
            case '&':
                result += "&amp;";
                break;
            default:
                result += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
        }
    }
    return result;
}

// The document in the making: lines, indented by the elements that are open.
struct Lines {
    std::string text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
    std::vector<const char*> open;

    void begin(const char* name) {
        text += std::string(2 * open.size(), ' ') + '<' + name + ">\n";
        open.push_back(name);
    }
    void end() {
        const std::string name = open.back();
        open.pop_back();
        text += std::string(2 * open.size(), ' ') + "</" + name + ">\n";
    }
    void add(const std::string& name, std::string_view value) {
        text += std::string(2 * open.size(), ' ') + '<' + name + '>' + escaped(value) + "</" + name + ">\n";
    }
};

std::string first_of(const Keywords& keywords, std::initializer_list<std::string_view> keys) {
    for (const std::string_view key : keys)
        for (const auto& [name, value] : keywords)
            if (name == key && !detail::trim(value).empty()) return value;
    return {};
}

bool is_date(std::string_view text) {
    constexpr std::string_view kForm = "dddd-dd-dd";
    return text.size() == kForm.size() && std::ranges::equal(text, kForm, [](char c, char form) {
               return form == 'd' ? c >= '0' && c <= '9' : c == form;
           });
}

bool is_digits(std::string_view text) {
    return !text.empty() && std::ranges::all_of(text, [](char c) { return c >= '0' && c <= '9'; });
}

void add_header(Lines& lines, const Keywords& keywords) {
    const auto or_unknown = [](const std::string& value) { return value.empty() ? std::string("unknown") : value; };
    const auto optional = [&](const char* name, const std::string& value) {
        if (!value.empty()) lines.add(name, value);
    };
    const std::string date = first_of(keywords, {"ISSUEDATE"});
    const std::string gtin = first_of(keywords, {"_GTIN"});
    const std::string created = first_of(keywords, {"_DOCUMENTDATE"});
    lines.begin("Header");
    optional("Manufacturer", first_of(keywords, {"MANUFAC"}));
    optional("CatalogNumber", first_of(keywords, {"LUMCAT"}));
    if (is_digits(gtin)) lines.add("GTIN", gtin);
    lines.add("Description", or_unknown(first_of(keywords, {"LUMINAIRE"})));
    lines.add("Laboratory", or_unknown(first_of(keywords, {"TESTLAB"})));
    lines.add("ReportNumber", or_unknown(first_of(keywords, {"TEST"})));
    lines.add("ReportDate", is_date(date) ? date : "1970-01-01");
    optional("DocumentCreator", first_of(keywords, {"_DOCUMENTCREATOR"}));
    if (is_date(created)) lines.add("DocumentCreationDate", created);
    optional("UniqueIdentifier", first_of(keywords, {"_UNIQUEIDENTIFIER"}));
    constexpr std::array kElsewhere = {"MANUFAC",
                                       "LUMCAT",
                                       "LUMINAIRE",
                                       "TESTLAB",
                                       "TEST",
                                       "LAMP",
                                       "LAMPCAT",
                                       "_GTIN",
                                       "_DOCUMENTCREATOR",
                                       "_DOCUMENTDATE",
                                       "_REFERENCE",
                                       "_MOREINFOURI",
                                       "_UNIQUEIDENTIFIER",
                                       "_COLORTEMP",
                                       "_CRI",
                                       "_DUV"};
    for (const auto& [key, value] : keywords) {
        if (std::ranges::find(kElsewhere, std::string_view(key)) != kElsewhere.end()) continue;
        if (key == "ISSUEDATE" && is_date(value)) continue;
        if (detail::trim(value).empty()) continue;
        lines.add("Comment", key.empty() || key == "OTHER" ? value : "[" + key + "] " + value);
    }
    for (const auto& [key, value] : keywords)
        if (key == "_REFERENCE") lines.add("Reference", value);
    optional("MoreInfoURI", first_of(keywords, {"_MOREINFOURI"}));
    lines.end();
}

struct Side {
    const char* name;
    const char* along;
    bool has_length;  // and no width
};
constexpr Side kSides[] = {
    {"C0", "Length", true}, {"C90", "Width", false}, {"C180", "Length", true}, {"C270", "Width", false}};

void add_areas(Lines& lines, const Opening& opening) {
    if (opening.shape == OpeningShape::point) return;
    const bool round = opening.width == opening.length &&
                       (opening.shape == OpeningShape::ellipse || opening.shape == OpeningShape::vertical_cylinder);
    const std::string length = decimal(opening.length.in(m));
    const std::string width = decimal(opening.width.in(m));
    const std::string height = decimal(opening.height.in(m));
    lines.begin("EmissionAreas");
    lines.begin("BottomFace");
    lines.add("NumberBottom", "1");
    lines.begin("BottomArea");
    lines.add("Length", length);
    lines.add("Width", width);
    lines.add("LengthOffset", "0");
    lines.add("WidthOffset", "0");
    if (round) lines.add("Circular", "true");
    lines.end();
    lines.end();
    for (const auto& [name, along, has_length] : kSides) {
        if (!(opening.height.in(m) > 0.0)) break;
        const std::string face = std::string(name) + "Face";
        const std::string area = std::string(name) + "Area";
        lines.begin(face.c_str());
        lines.add("Number" + std::string(name), "1");
        lines.begin(area.c_str());
        lines.add(along, has_length ? length : width);
        lines.add("Height", height);
        lines.add(std::string(along) + "Offset", "0");
        lines.add("HeightOffset", "0");
        lines.end();
        lines.end();
    }
    lines.end();
}

const char* symm_name(Symmetry symmetry) {
    constexpr std::array kNames = {"Symm_Full", "Symm_Quad", "Symm_Bi_0", "Symm_Bi_90", "Symm_None"};
    return kNames[std::min<std::size_t>(static_cast<std::size_t>(symmetry), kNames.size() - 1)];
}

void add_intensities(Lines& lines, const PhotometricWeb& web, bool absolute) {
    detail::FoldedPlanes planes;
    if (web.goniometer == Goniometer::type_c) {
        planes = detail::fold(web);
    } else {
        for (std::size_t h = 0; h < web.h_rad.size(); ++h) planes.columns.push_back(h);
    }
    const std::size_t nv = web.v_rad.size();
    lines.begin("LuminousIntensity");
    lines.add("AbsolutePhotometry", absolute ? "true" : "false");
    lines.add("Symm", symm_name(planes.symmetry));
    lines.add("NumberMeasured", std::to_string(planes.columns.size() * nv));
    lines.add("NumberHorz", std::to_string(planes.columns.size()));
    lines.add("NumberVert", std::to_string(nv));
    const std::string indent(2 * lines.open.size(), ' ');
    std::vector<std::string> v_texts;
    for (const double v : web.v_rad) v_texts.push_back(decimal(detail::tidy_degrees(v)));
    for (const std::size_t h : planes.columns) {
        const std::string begin = indent + "<IntData h=\"" + decimal(detail::tidy_degrees(web.h_rad[h])) + "\" v=\"";
        for (std::size_t v = 0; v < nv; ++v) {
            lines.text += begin + v_texts[v] + "\">";
            detail::append_number(lines.text, web.at(h, v));
            lines.text += "</IntData>\n";
        }
    }
    lines.end();
}

void add_emitter(Lines& lines, const Photometry& photometry) {
    const Provenance& p = photometry.provenance;
    const std::string lamp = first_of(p.keywords, {"LAMP"});
    const std::string catalogue = first_of(p.keywords, {"LAMPCAT"});
    lines.begin("Emitter");
    lines.add("Quantity", std::to_string(std::max(1, p.lamps)));
    lines.add("Description", lamp.empty() ? "unknown" : lamp);
    if (!catalogue.empty()) lines.add("CatalogNumber", catalogue);
    if (!p.absolute) lines.add("RatedLumens", decimal(p.rated_lumens / std::max(1, p.lamps)));
    lines.add("InputWattage", decimal(p.input_watts));
    if (photometry.tilt) {
        lines.begin("TiltAngles");
        lines.add("NumberAngles", std::to_string(photometry.tilt->angle_rad.size()));
        for (std::size_t i = 0; i < photometry.tilt->angle_rad.size(); ++i)
            lines.text += std::string(2 * lines.open.size(), ' ') + "<Tilt angle=\"" +
                          decimal(detail::tidy_degrees(photometry.tilt->angle_rad[i])) + "\">" +
                          decimal(photometry.tilt->factor[i]) + "</Tilt>\n";
        lines.end();
    }
    std::string colour = first_of(p.keywords, {"_COLORTEMP"});
    if (colour.ends_with('K')) colour = detail::trim(std::string_view(colour).substr(0, colour.size() - 1));
    if (is_digits(colour)) {
        lines.begin("ColorTemperature");
        lines.add("FixedCCT", colour);
        lines.end();
    }
    if (const std::string cri = first_of(p.keywords, {"_CRI"}); is_digits(cri)) {
        lines.begin("ColorRendering");
        lines.begin("CIE_CRI");
        lines.add("Ra", cri);
        lines.end();
        lines.end();
    }
    lines.begin("LuminousData");
    add_intensities(lines, photometry.web, p.absolute);
    lines.add("LuminousFlux", decimal(std::round(total_flux(photometry.web).in(lm)*1e6) / 1e6));
    lines.end();
    add_areas(lines, photometry.opening);
    lines.end();
}

}  // namespace

std::string write_tm33(const Photometry& photometry) {
    constexpr std::array kTypes = {"IES_C", "IES_B", "IES_A"};
    Lines lines;
    lines.begin("IESTM33-22");
    lines.add("Version", "1.1");
    add_header(lines, photometry.provenance.keywords);
    lines.begin("Equipment");
    lines.begin("Gonioradiometer");
    lines.add("Type", kTypes[static_cast<std::size_t>(photometry.web.goniometer)]);
    lines.end();
    lines.end();
    add_emitter(lines, photometry);
    lines.end();
    return std::move(lines.text);
}

}  // namespace gonio::ies

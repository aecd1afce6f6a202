#include "ies/gldf.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <pugixml.hpp>
#include <unordered_map>

#include "ies/core/decomposed_text.h"
#include "ies/core/printed.h"
#include "ies/core/text.h"
#include "ies/core/zip.h"
#include "ies/gldf_lights.h"
#include "ies/grid.h"
#include "ies/l3d.h"
#include "ies/photometry_file.h"
#include "ies/text_encoding.h"
#include "ies/text_scan.h"
#include "ies/xml_text.h"

namespace gonio::ies {

namespace {

using detail::is_light;
using detail::Light;
using detail::offset_of;
using detail::Report;
using detail::text_of;
using pugi::xml_node;
using Index = std::unordered_map<std::string_view, xml_node>;

constexpr std::size_t kListed = 8;  // names in a note or an error
constexpr const char* kProduct = "product.xml";

ZipLimits limits() {
    ZipLimits result;
    result.archive_bytes = result.entry_bytes = kMaxFileBytes;
    result.total_bytes = 4 * kMaxFileBytes;
    return result;
}

struct Product {
    std::string_view text;  // of product.xml
    const ZipArchive& archive;
    Report& report;
    xml_node root;
    Index files, photometries, emitters, light_sources, equipments, geometries;

    Error error(const xml_node& place, std::string code, std::string_view value, std::string message) const {
        Error result = detail::error_at(text, offset_of(place), std::move(code), value, std::move(message));
        result.where = std::string(kProduct) + " " + result.where;
        return result;
    }
};

// The elements of a section by their ids; of two with one id the first.
Index index_of(const xml_node& section) {
    Index index;
    for (const xml_node& element : section.children()) index.emplace(element.attribute("id").value(), element);
    return index;
}

xml_node found(const Index& index, std::string_view id) {
    const auto at = index.find(id);
    return at == index.end() ? xml_node() : at->second;
}

// A number that is there and sound, else 0: of what is no part of the chain, a fault is only told.
double number_or_0(const Product& product, const xml_node& element) {
    double value = 0.0;
    if (!element) return 0.0;
    if (!detail::read_number(product.text, element, text_of(element), element.name(), value)) return value;
    product.report.warn("not_a_number", offset_of(element),
                        std::string(element.name()) + " is no number; it is ignored");
    return 0.0;
}

std::string_view locale_of(const xml_node& element) {
    return text_of(element.child("Locale"));
}

// Names in a list that has an end.
struct Names {
    std::string text;
    std::size_t count = 0;

    void add(std::string_view name) {
        if (++count <= kListed) text += (count > 1 ? ", " : "") + shown_text(name, 60);
        if (count == kListed + 1) text += ", ...";
    }
};

Result<xml_node> choose_variant(const Product& product, const std::string& wanted) {
    const xml_node variants = product.root.child("ProductDefinitions").child("Variants");
    xml_node chosen;
    Names names;
    for (const xml_node& variant : variants.children("Variant")) {
        const std::string_view id = variant.attribute("id").value();
        names.add(std::string(id) + " \"" + std::string(locale_of(variant.child("Name"))) + '"');
        const auto is_named = [&](const xml_node& locale) { return text_of(locale) == wanted; };
        const bool fits = wanted.empty()
                              ? !chosen && !detail::lights_of(variant).empty()
                              : id == wanted || std::ranges::any_of(variant.child("Name").children("Locale"), is_named);
        if (!chosen && fits) chosen = variant;
    }
    if (names.count == 0) return product.error(product.root, "no_variant", {}, "the product has no Variant");
    if (!chosen && wanted.empty() && detail::lone_emitter(product.root)) chosen = variants.child("Variant");
    if (!chosen && wanted.empty())
        return product.error(variants, "no_emitter", {}, "no variant of the product has an emitter");
    if (!chosen)
        return product.error(variants, "no_such_variant", wanted,
                             "the product has no such variant; it has " + names.text);
    if (names.count > 1)
        product.report.note("variants", offset_of(chosen),
                            std::string("the variant ") + chosen.attribute("id").value() +
                                (wanted.empty() ? " is taken, the first with an emitter of " : " is taken of ") +
                                names.text);
    return chosen;
}

struct Chosen {
    Light light;
    xml_node emitter;  // FixedLightEmitter, ChangeableLightEmitter or MultiChannelLightEmitter
};

// "ID/2" names the second light emitter of the emitter ID.
bool split_number(const std::string& wanted, std::string& id, std::size_t& number) {
    const std::size_t slash = wanted.rfind('/');
    if (slash == std::string::npos || slash + 1 >= wanted.size() || wanted.size() - slash > 5) return false;
    number = 0;
    for (const char c : std::string_view(wanted).substr(slash + 1)) {
        if (c < '0' || c > '9') return false;
        number = 10 * number + static_cast<std::size_t>(c - '0');
    }
    id = wanted.substr(0, slash);
    return number > 0;
}

Result<xml_node> light_emitter_of(const Product& product, const Light& light, std::size_t number) {
    const xml_node emitter = found(product.emitters, light.emitter);
    if (!emitter)
        return product.error(light.reference, "missing_reference", light.emitter, "there is no Emitter of this id");
    xml_node first;
    xml_node chosen;
    std::size_t count = 0;
    for (const xml_node& element : emitter.children()) {
        if (!is_light(element)) continue;
        ++count;
        if (!first) first = element;
        const bool emergency = element.attribute("emergencyBehaviour").value() == std::string_view("EmergencyOnly");
        if (!chosen && (number > 0 ? count == number : !emergency)) chosen = element;
    }
    if (!chosen && number == 0) chosen = first;
    if (!chosen)
        return product.error(
            emitter, count == 0 ? "no_light" : "no_such_emitter", light.emitter,
            count == 0 ? "the emitter is a sensor's, or has no light" : "the emitter has fewer light emitters");
    if (count > 1 && number == 0)
        product.report.note("light_emitters", offset_of(chosen),
                            "one of " + std::to_string(count) + " interchangeable light emitters is taken; " +
                                shown_text(light.emitter, 60) + "/2 names the second");
    return chosen;
}

Result<Chosen> choose_light(const Product& product, const xml_node& variant, const std::string& wanted) {
    std::vector<Light> lights = detail::lights_of(variant);
    if (const xml_node lone = lights.empty() ? detail::lone_emitter(product.root) : xml_node()) {
        lights.push_back({lone, lone.attribute("id").value(), {}, {}, {}});
        product.report.note(
            "emitter_assumed", offset_of(variant),
            "the variant names no emitter: it has the product's only one, " + shown_text(lights.back().emitter, 60));
    }
    if (lights.empty()) return product.error(variant, "no_emitter", {}, "the variant has no emitter");
    std::string id;
    std::size_t number = 0;
    const bool numbered = split_number(wanted, id, number);
    const Light* chosen = nullptr;
    const Light* numbered_one = nullptr;
    Names names;
    for (const Light& light : lights) {
        const xml_node emitter = found(product.emitters, light.emitter);
        const bool lit = !emitter || emitter.find_child(is_light);
        names.add(std::string(light.emitter) +
                  (light.object.empty() ? std::string() : " \"" + std::string(light.object) + '"'));
        if (!chosen && (wanted.empty() ? lit : light.emitter == wanted || light.object == wanted)) chosen = &light;
        if (!numbered_one && numbered && (light.emitter == id || light.object == id)) numbered_one = &light;
    }
    if (!chosen && numbered_one) {
        chosen = numbered_one;
    } else {
        number = 0;
    }
    if (!chosen && wanted.empty())
        return product.error(variant, "no_light", {}, "no emitter of the variant has light: all are sensors");
    if (!chosen)
        return product.error(variant, "no_such_emitter", wanted,
                             "the variant has no such emitter; it has " + names.text);
    if (names.count > 1)
        product.report.note("emitters", offset_of(chosen->reference),
                            "the emitter " + shown_text(chosen->emitter, 60) +
                                (wanted.empty() ? " is taken, the first of " : " is taken of ") + names.text);
    const auto emitter = light_emitter_of(product, *chosen, number);
    if (!emitter) return emitter.error();
    return Chosen{*chosen, *emitter};
}

// What burns in the emitter; 0 where the product does not tell.
struct Lamps {
    double lumens = 0.0;
    double watts = 0.0;
    xml_node source;
    std::string_view photometry;  // id
};

xml_node referred(const Product& product, const Index& index, const xml_node& reference, const char* attribute) {
    if (!reference) return {};
    const xml_node target = found(index, reference.attribute(attribute).value());
    if (!target)
        product.report.warn("missing_reference", offset_of(reference),
                            "there is nothing of the id " + shown_text(reference.attribute(attribute).value(), 60));
    return target;
}

Lamps lamps_of(const Product& product, const xml_node& emitter) {
    Lamps lamps;
    const std::string_view kind = emitter.name();
    const xml_node reference = emitter.child("LightSourceReference");
    lamps.photometry = emitter.child("PhotometryReference").attribute("photometryId").value();
    if (kind == "FixedLightEmitter") {
        lamps.source = referred(product, product.light_sources, reference, "fixedLightSourceId");
        lamps.lumens = number_or_0(product, emitter.child("RatedLuminousFlux"));
        lamps.watts = number_or_0(product, lamps.source.child("RatedInputPower"));
    } else if (kind == "ChangeableLightEmitter") {
        const xml_node equipment =
            referred(product, product.equipments, emitter.child("EquipmentReference"), "equipmentId");
        const xml_node lamp = equipment.child("LightSourceReference");
        lamps.source = referred(product, product.light_sources, lamp, "changeableLightSourceId");
        const int count = std::clamp(lamp.attribute("lightSourceCount").as_int(1), 1, 1'000'000);
        lamps.lumens = count * number_or_0(product, lamps.source.child("RatedLuminousFlux"));
        lamps.watts = number_or_0(product, equipment.child("RatedInputPower"));
    } else {
        lamps.source = referred(product, product.light_sources, reference, "multiChannelLightSourceId");
        lamps.watts = number_or_0(product, lamps.source.child("RatedInputPower"));
        std::size_t others = 0;
        for (const xml_node& channel : lamps.source.child("Channels").children("Channel")) {
            const std::string_view id = channel.child("PhotometryReference").attribute("photometryId").value();
            if (lamps.photometry.empty()) lamps.photometry = id;
            if (id == lamps.photometry) {
                lamps.lumens += number_or_0(product, channel.child("RatedLuminousFlux"));
            } else {
                ++others;
            }
        }
        if (others > 0)
            product.report.warn("channels", offset_of(lamps.source),
                                std::to_string(others) + " channels with another photometry are left out");
    }
    if (lamps.photometry.empty())
        lamps.photometry = lamps.source.child("PhotometryReference").attribute("photometryId").value();
    return lamps;
}

// Result: the archive's name of a file, "" where it has none: exactly, in code page 850, or without regard to case and
// to how accents are spelt.
std::string name_in(const Product& product, const std::string& path, const xml_node& place) {
    if (product.archive.find(path)) return path;
    const auto folded = [](std::string_view name) { return detail::to_upper(decomposed_text(name)); };
    const std::string wanted = folded(path);
    for (const ZipEntry& entry : product.archive.entries())
        if (folded(detail::to_utf8(entry.raw_name, detail::Encoding::code_page_850)) == wanted ||
            folded(entry.name) == wanted) {
            product.report.note("file_name", offset_of(place), "the name is written otherwise in the archive");
            return entry.name;
        }
    return {};
}

// folder: of the archive. Result: the bytes of a File; its name in the archive goes to path.
Result<std::string> read_file(const Product& product, const xml_node& file, const std::string& folder,
                              std::string& path) {
    path = folder + "/" + std::string(text_of(file));
    if (file.attribute("type").value() == std::string_view("url"))
        return product.error(file, "file_not_fetched", text_of(file), "the file is on the network; it is not fetched");
    const std::string name = name_in(product, path, file);
    if (name.empty()) return product.error(file, "missing_file", path, "the archive lacks the file");
    path = name;
    return product.archive.read(name);
}

Result<Photometry> read_light_file(const Product& product, const xml_node& place, std::string_view photometry_id,
                                   std::string& path) {
    const xml_node photometry = found(product.photometries, photometry_id);
    if (!photometry)
        return product.error(place, "missing_reference", photometry_id, "there is no Photometry of this id");
    const xml_node reference = photometry.child("PhotometryFileReference");
    const std::string_view file_id = reference.attribute("fileId").value();
    const xml_node file = found(product.files, file_id);
    if (!file)
        return product.error(reference ? reference : photometry, "missing_reference", file_id,
                             "there is no File of this id");
    const auto bytes = read_file(product, file, "ldc", path);
    if (!bytes) return bytes.error();
    if (looks_like_zip(*bytes))
        return Error{"unknown_format", path, {}, "an archive within the archive is no photometric file"};
    auto read = read_photometry(*bytes);
    if (!read) {
        Error error = read.error();
        error.where = shown_text(path, 200) + " " + error.where;
        return error;
    }
    return read;
}

std::optional<Error> scale_flux(const Product& product, const xml_node& emitter, double rated, Photometry& result) {
    Provenance& p = result.provenance;
    const double now = p.rated_lumens > 0.0 ? p.rated_lumens : total_flux(result.web).in(lm);
    if (!(rated > 0.0) || !(now > 0.0)) {
        product.report.note("flux_not_scaled", offset_of(emitter),
                            "no rated luminous flux, or a dark web: the photometric file's flux stays");
        return std::nullopt;
    }
    const double factor = rated / now;
    if (p.rated_lumens > 0.0) {
        p.rated_lumens = rated;
        p.lumens_per_lamp = rated / std::max(1, std::abs(p.lamps));
    }
    if (std::abs(factor - 1.0) < 1e-6) return std::nullopt;
    if (!(peak_intensity(result.web).in(cd)*factor <= kMaxCandela))
        return product.error(emitter, "candela_too_large", print_number(rated), "more than 1e12 cd at the rated flux");
    for (float& candela : result.web.candela) candela = static_cast<float>(double{candela} * factor);
    p.multiplier *= factor;
    p.scale *= factor;
    product.report.note("flux_scaled", offset_of(emitter),
                        printed("the %s of the photometric file, %g lm, becomes the emitter's rated %g lm",
                                p.rated_lumens > 0.0 ? "lamps' flux" : "flux", now, rated));
    return std::nullopt;
}

void apply_rotation(const Product& product, const xml_node& emitter, Photometry& result) {
    const xml_node rotation = emitter.child("Rotation");
    std::array<double, 4> degrees{};
    constexpr std::array kAxes = {"X", "Y", "Z", "G0"};
    for (std::size_t i = 0; i < kAxes.size(); ++i) degrees[i] = number_or_0(product, rotation.child(kAxes[i]));
    const auto is_turn = [](double value) { return std::abs(std::remainder(value, 360.0)) > 1e-9; };
    if (std::ranges::none_of(degrees, is_turn)) return;
    const bool vertical = !is_turn(degrees[0]) && !is_turn(degrees[1]) && !is_turn(degrees[3]);
    const std::string turn = printed("X %g, Y %g, Z %g, G0 %g degrees", degrees[0], degrees[1], degrees[2], degrees[3]);
    if (!vertical || result.web.goniometer != Goniometer::type_c) {
        product.report.warn("rotation_not_applied", offset_of(rotation),
                            "the emitter is turned by " + turn + ", which is left out");
        return;
    }
    if (result.web.h_rad.size() > 2)
        detail::turn_about_vertical(result.web, Angle::degrees(std::remainder(degrees[2], 360.0)), product.report);
    product.report.note("rotated", offset_of(rotation), "the web is turned by " + turn);
}

bool opening_of_model(const Product& product, const Light& light, Opening& opening) {
    const xml_node geometry = found(product.geometries, light.model);
    for (const xml_node& reference : geometry.children("GeometryFileReference")) {
        const xml_node file = found(product.files, reference.attribute("fileId").value());
        if (file.attribute("contentType").value() != std::string_view("geo/l3d")) continue;
        std::string path;
        auto bytes = read_file(product, file, "geo", path);
        const auto objects = bytes ? detail::read_l3d(std::move(*bytes)) : bytes.error();
        if (!objects) {
            product.report.warn("geometry_not_read", offset_of(reference),
                                "the model " + shown_text(path, 80) + " gives no opening: " + objects.error().text());
            return false;
        }
        auto object = std::ranges::find(*objects, light.object, &detail::L3dObject::name);
        if (object == objects->end() && objects->size() == 1) object = objects->begin();
        if (object == objects->end() || object->opening.shape == OpeningShape::point) break;
        if (!(std::max(object->opening.width.in(m), object->opening.length.in(m)) > 0.0)) break;
        if (object->turned)
            product.report.warn("opening_turned", offset_of(reference),
                                "the luminous object is turned; its opening is taken as if it faced down");
        opening = object->opening;
        return true;
    }
    if (!light.model.empty())
        product.report.warn("geometry_not_read", offset_of(light.reference),
                            "no L3D model has a luminous object " + shown_text(light.object, 60));
    return false;
}

bool opening_of_simple(const Product& product, const Light& light, Opening& opening) {
    const xml_node geometry = found(product.geometries, light.simple);
    const auto metres = [&](const xml_node& element) { return std::abs(number_or_0(product, element)) * 1e-3; };
    double height = 0.0;
    for (const char* side : {"C0", "C90", "C180", "C270"})
        height = std::max(height, metres(geometry.child("C-Heights").child(side)));
    if (const xml_node rectangle = geometry.child("RectangularEmitter")) {
        opening = {height > 0.0 ? OpeningShape::box : OpeningShape::rectangle, metres(rectangle.child("Width")) * m,
                   metres(rectangle.child("Length")) * m, height * m};
    } else if (const xml_node circle = geometry.child("CircularEmitter")) {
        const Length diameter = metres(circle.child("Diameter")) * m;
        opening = {height > 0.0 ? OpeningShape::vertical_cylinder : OpeningShape::ellipse, diameter, diameter,
                   height * m};
    } else {
        return false;
    }
    return opening.width.in(m) > 0.0 && opening.length.in(m) > 0.0;
}

void read_opening(const Product& product, const Light& light, Photometry& result) {
    Opening opening;
    const bool model = opening_of_model(product, light, opening);
    if (!model && !opening_of_simple(product, light, opening)) return;
    result.opening = opening;
    product.report.note("opening_from_geometry", offset_of(light.reference),
                        model ? "the opening is that of the L3D model" : "the opening is that of the simple geometry");
}

void add_keywords(const Product& product, const xml_node& variant, const Chosen& chosen, const Lamps& lamps,
                  Provenance& p) {
    const auto set = [&](const char* key, std::string_view value, bool replace) {
        if (value.empty()) return;
        const auto at =
            std::ranges::find(p.keywords, std::string_view(key), &std::pair<std::string, std::string>::first);
        if (at == p.keywords.end()) {
            p.keywords.emplace_back(key, value);
        } else if (replace) {
            at->second = value;
        }
    };
    const xml_node product_data = product.root.child("ProductDefinitions").child("ProductMetaData");
    const xml_node colour = lamps.source.child("ColorInformation");
    set("MANUFAC", text_of(product.root.child("Header").child("Manufacturer")), true);
    set("LUMINAIRE", locale_of(product_data.child("Name")), true);
    set("LUMCAT", locale_of(product_data.child("ProductNumber")), true);
    set("LAMP", locale_of(lamps.source.child("Name")), true);
    set("_COLORTEMP", text_of(colour.child("CorrelatedColorTemperature")), true);
    set("_CRI", text_of(colour.child("ColorRenderingIndex")), true);
    set("_VARIANT", variant.attribute("id").value(), true);
    set("_EMITTER", chosen.light.emitter, true);
}

Result<Photometry> read_product(const Product& product, const Choice& choice) {
    const xml_node version = product.root.child("Header").child("FormatVersion");
    if (version.attribute("major").value() != std::string_view("1") && !text_of(version).starts_with("1."))
        product.report.warn("unknown_version", offset_of(version ? version : product.root),
                            "the format's version is not 1; it is read as 1.0.0-rc.3");
    if (const auto& clashes = product.archive.case_clashes(); !clashes.empty())
        product.report.note("case_clash", 0,
                            "names in the archive differ by case only: " + shown_text(clashes.front(), 80));
    const auto variant = choose_variant(product, choice.variant);
    if (!variant) return variant.error();
    const auto chosen = choose_light(product, *variant, choice.emitter);
    if (!chosen) return chosen.error();
    const Lamps lamps = lamps_of(product, chosen->emitter);
    std::string path;
    auto result = read_light_file(product, chosen->emitter, lamps.photometry, path);
    if (!result) return result;
    for (Diagnostic& diagnostic : result->diagnostics) diagnostic.message += " (" + shown_text(path, 200) + ")";

    Provenance& p = result->provenance;
    p.format = "GLDF with " + p.format;
    if (auto error = scale_flux(product, chosen->emitter, lamps.lumens, *result)) return *error;
    if (lamps.watts > 0.0) p.input_watts = lamps.watts;
    apply_rotation(product, chosen->emitter, *result);
    read_opening(product, chosen->light, *result);
    add_keywords(product, *variant, *chosen, lamps, p);
    result->eulumdat.reset();  // its lamps are not those of the product
    std::vector<Diagnostic> own = product.report.take();
    result->diagnostics.insert(result->diagnostics.begin(), own.begin(), own.end());
    return result;
}

}  // namespace

Result<Photometry> read_gldf(std::string_view bytes, const Choice& choice) {
    const auto archive = open_zip(std::string(bytes), limits());
    if (!archive) return archive.error();
    if (!archive->find(kProduct))
        return Error{"no_product", kProduct, {}, "the archive has no product.xml: it is no GLDF file"};
    const auto product_bytes = archive->read(kProduct);
    if (!product_bytes) return product_bytes.error();
    const std::string text = detail::xml_as_utf8(*product_bytes);
    pugi::xml_document xml;
    if (auto error = detail::parse_xml(text, xml)) {
        error->where = std::string(kProduct) + " " + error->where;
        return *error;
    }
    Report report(text);
    Product product{text, *archive, report, xml.document_element(), {}, {}, {}, {}, {}, {}};
    if (product.root.name() != std::string_view("Root"))
        return product.error(product.root, "unknown_root", product.root.name(), "the root element is not Root");
    const xml_node definitions = product.root.child("GeneralDefinitions");
    product.files = index_of(definitions.child("Files"));
    product.photometries = index_of(definitions.child("Photometries"));
    product.emitters = index_of(definitions.child("Emitters"));
    product.light_sources = index_of(definitions.child("LightSources"));
    product.equipments = index_of(definitions.child("Equipments"));
    product.geometries = index_of(definitions.child("Geometries"));
    return read_product(product, choice);
}

}  // namespace gonio::ies

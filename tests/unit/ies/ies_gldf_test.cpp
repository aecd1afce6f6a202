// GLDF: containers written here, each about one rule, and the shared samples with what each must give.
#include "ies/gldf.h"

#include <gtest/gtest.h>

#include <map>

#include "ies/core/printed.h"
#include "ies/core/zip.h"
#include "ies/photometry_file.h"
#include "tests/shared_data.h"
#include "tests/unit/ies_test_support.h"

namespace gonio::ies {
namespace {

using test::at;
using test::has;
using test::Lm63Text;

std::string zip_of(const std::vector<ZipFile>& files) {
    const auto bytes = write_zip(files);
    EXPECT_TRUE(bytes) << (bytes ? "" : bytes.error().text());
    return bytes ? *bytes : "";
}

// The parts of a container; each test changes those it is about. The light gives 100 cd at the nadir and shines along
// C0, absolute.
struct Gldf {
    std::string files = "<File id=\"ldc\" contentType=\"ldc/ies\" type=\"localFileName\">a.ies</File>";
    std::string photometries = "<Photometry id=\"p\"><PhotometryFileReference fileId=\"ldc\"/></Photometry>";
    std::string sources;
    std::string equipments;
    std::string light = "<FixedLightEmitter><PhotometryReference photometryId=\"p\"/></FixedLightEmitter>";
    std::string more_emitters;
    std::string geometries;
    std::string geometry = "<EmitterReference emitterId=\"e\"/>";
    std::string more_variants;
    Lm63Text lm63;
    std::vector<ZipFile> more_files;

    std::string product() const {
        return "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<Root>\n<Header><Manufacturer>Acme</Manufacturer>"
               "<FormatVersion major=\"1\" minor=\"0\" pre-release=\"3\"/></Header>\n<GeneralDefinitions>\n<Files>" +
               files + "</Files>\n<Photometries>" + photometries + "</Photometries>\n<LightSources>" + sources +
               "</LightSources><Equipments>" + equipments + "</Equipments>\n<Emitters><Emitter id=\"e\">" + light +
               "</Emitter>" + more_emitters + "</Emitters>\n<Geometries>" + geometries +
               "</Geometries></GeneralDefinitions>\n<ProductDefinitions><ProductMetaData><Name><Locale>Lumen</Locale>"
               "</Name></ProductMetaData><Variants>\n<Variant id=\"v1\"><Name><Locale>white</Locale></Name><Geometry>" +
               geometry + "</Geometry></Variant>\n" + more_variants + "</Variants></ProductDefinitions></Root>\n";
    }
    std::string bytes() const {
        std::vector<ZipFile> all = {{"product.xml", product()}, {"ldc/a.ies", lm63.text()}};
        all.insert(all.end(), more_files.begin(), more_files.end());
        return zip_of(all);
    }
};

Photometry read_well(const Gldf& file, const Choice& choice = {}) {
    auto read = read_photometry(file.bytes(), choice);
    EXPECT_TRUE(read) << (read ? "" : read.error().text());
    return read ? *read : Photometry{};
}

std::string fault_of(const Gldf& file, const Choice& choice = {}) {
    const auto read = read_photometry(file.bytes(), choice);
    return read ? "" : read.error().code + ", " + read.error().where + ", " + read.error().value;
}

double flux_of(const Photometry& photometry) {
    return total_flux(photometry.web).in(lm);
}

TEST(Gldf, TheChainLeadsToThePhotometry) {
    Gldf file;
    const Photometry read = read_well(file);
    const auto alone = read_photometry(file.lm63.text());
    EXPECT_EQ(read.web, alone->web);
    EXPECT_EQ(read.provenance.format, "GLDF with LM-63-2019");
    const auto keyword = [&](const char* key) {
        const auto& all = read.provenance.keywords;
        const auto found = std::ranges::find(all, key, &std::pair<std::string, std::string>::first);
        return found == all.end() ? std::string() : found->second;
    };
    EXPECT_EQ(keyword("MANUFAC"), "Acme");
    EXPECT_EQ(keyword("LUMINAIRE"), "Lumen");
    EXPECT_EQ(keyword("_VARIANT"), "v1");
    EXPECT_EQ(keyword("_EMITTER"), "e");
    EXPECT_TRUE(has(read, "flux_not_scaled"));
}

TEST(Gldf, FluxOfAbsolutePhotometryBecomesTheRatedOne) {
    Gldf file;
    file.light =
        "<FixedLightEmitter><PhotometryReference photometryId=\"p\"/><LightSourceReference fixedLightSourceId=\"s\"/>"
        "<RatedLuminousFlux>1234</RatedLuminousFlux></FixedLightEmitter>";
    file.sources = "<FixedLightSource id=\"s\"><RatedInputPower>12.5</RatedInputPower></FixedLightSource>";
    const Photometry read = read_well(file);
    EXPECT_NEAR(flux_of(read), 1234.0, 1e-3);
    EXPECT_EQ(read.provenance.input_watts, 12.5);
    EXPECT_TRUE(has(read, "flux_scaled"));
}

// Older drafts: a Geometry that names no emitter of a product that has one, and references in the Variant itself.
TEST(Gldf, OlderDraftsAreRead) {
    Gldf empty;
    empty.geometry.clear();
    empty.more_emitters = "<Emitter id=\"s\"><SensorEmitter/></Emitter>";
    const Photometry lone = read_well(empty);
    EXPECT_EQ(peak_intensity(lone.web).in(cd), 100.0);
    EXPECT_TRUE(has(lone, "emitter_assumed"));
    EXPECT_FALSE(has(read_well(Gldf{}), "emitter_assumed"));
    Gldf second = empty;  // one that names its emitter goes before one that does not
    second.more_variants = "<Variant id=\"v2\"><Geometry><EmitterReference emitterId=\"e\"/></Geometry></Variant>";
    EXPECT_FALSE(has(read_well(second), "emitter_assumed"));
    for (const char* inside : {"<EmitterReference emitterId=\"e\"/>",
                               "<EmitterReferences><EmitterReference emitterId=\"e\"/></EmitterReferences>"}) {
        Gldf direct;
        direct.geometry = std::string("</Geometry>") + inside + "<Geometry>";
        direct.more_emitters = "<Emitter id=\"e2\">" + direct.light + "</Emitter>";
        const Photometry read = read_well(direct);
        EXPECT_EQ(peak_intensity(read.web).in(cd), 100.0);
        EXPECT_FALSE(has(read, "emitter_assumed"));
        EXPECT_EQ(peak_intensity(read_well(direct, {"v1", "e"}).web).in(cd), 100.0);
    }
}

// Relative photometry keeps its light output ratio: 2 lamps of 500 lm in the file, 3 of 800 lm in the product.
TEST(Gldf, LampsOfRelativePhotometryAreTheEquipments) {
    Gldf file;
    file.lm63.lamps = "2 500 1";
    const double before = flux_of(read_well(file));
    file.light =
        "<ChangeableLightEmitter><PhotometryReference photometryId=\"p\"/><EquipmentReference equipmentId=\"q\"/>"
        "</ChangeableLightEmitter>";
    file.equipments =
        "<Equipment id=\"q\"><LightSourceReference changeableLightSourceId=\"s\" lightSourceCount=\"3\"/>"
        "<RatedInputPower>99</RatedInputPower></Equipment>";
    file.sources =
        "<ChangeableLightSource id=\"s\"><ColorInformation><CorrelatedColorTemperature>4000"
        "</CorrelatedColorTemperature></ColorInformation><RatedLuminousFlux>800</RatedLuminousFlux>"
        "</ChangeableLightSource>";
    const Photometry read = read_well(file);
    EXPECT_NEAR(flux_of(read), 2.4 * before, 1e-4 * before);
    EXPECT_NEAR(at(read, 0, 0), 240.0, 1e-4);
    EXPECT_EQ(read.provenance.rated_lumens, 2400.0);
    EXPECT_EQ(read.provenance.input_watts, 99.0);
}

TEST(Gldf, ChannelsOfOnePhotometryAddUp) {
    Gldf file;
    file.light =
        "<MultiChannelLightEmitter><LightSourceReference multiChannelLightSourceId=\"s\"/></MultiChannelLightEmitter>";
    const auto channel = [](const char* id, int lumens) {
        return printed(
            "<Channel><PhotometryReference photometryId=\"%s\"/><RatedLuminousFlux>%d</RatedLuminousFlux></Channel>",
            id, lumens);
    };
    file.sources = "<MultiChannelLightSource id=\"s\"><Channels>" + channel("p", 300) + channel("other", 50) +
                   channel("p", 200) + "</Channels></MultiChannelLightSource>";
    const Photometry read = read_well(file);
    EXPECT_NEAR(flux_of(read), 500.0, 1e-3);
    EXPECT_TRUE(has(read, "channels"));
}

TEST(Gldf, VariantsAndEmittersAreChosen) {
    Gldf file;
    file.files += "<File id=\"two\" contentType=\"ldc/ies\" type=\"localFileName\">b.ies</File>";
    file.photometries += "<Photometry id=\"p2\"><PhotometryFileReference fileId=\"two\"/></Photometry>";
    const auto light = [](const char* more) {
        return "<FixedLightEmitter" + std::string(more) +
               "><PhotometryReference photometryId=\"p2\"/></FixedLightEmitter>";
    };
    file.more_emitters = "<Emitter id=\"e2\">" + light("") + "</Emitter><Emitter id=\"s\"><SensorEmitter/></Emitter>";
    file.light = light(" emergencyBehaviour=\"EmergencyOnly\"") + file.light;
    file.more_variants =
        "<Variant id=\"v2\"><Name><Locale>black</Locale></Name><Geometry><ModelGeometryReference geometryId=\"g\">"
        "<EmitterReference "
        "emitterId=\"s\"><EmitterObjectExternalName>eye</EmitterObjectExternalName></EmitterReference>"
        "<EmitterReference "
        "emitterId=\"e2\"><EmitterObjectExternalName>up</EmitterObjectExternalName></EmitterReference>"
        "<EmitterReference "
        "emitterId=\"e\"><EmitterObjectExternalName>down</EmitterObjectExternalName></EmitterReference>"
        "</ModelGeometryReference></Geometry></Variant>";
    Lm63Text second;
    second.candela = "7 5 0";
    file.more_files = {{"ldc/b.ies", second.text()}};
    struct Case {
        Choice choice;
        double peak;
    };
    for (const auto& [choice, peak] : {Case{{}, 100.0},
                                       {{"v1", ""}, 100.0},
                                       {{"v1", "e/1"}, 7.0},
                                       {{"v1", "e/2"}, 100.0},
                                       {{"v2", ""}, 7.0},
                                       {{"black", "e2"}, 7.0},
                                       {{"black", "up"}, 7.0},
                                       {{"v2", "down"}, 100.0},
                                       {{"v2", "down/1"}, 7.0}}) {
        const Photometry read = read_well(file, choice);
        EXPECT_EQ(peak_intensity(read.web).in(cd), peak) << choice.variant << " " << choice.emitter;
        EXPECT_TRUE(has(read, "variants"));
        EXPECT_EQ(has(read, "emitters"), choice.variant == "v2" || choice.variant == "black");
    }
    EXPECT_TRUE(has(read_well(file), "light_emitters"));
    EXPECT_EQ(fault_of(file, {"v3", ""}), "no_such_variant, product.xml line 10 column 92, v3");
    EXPECT_EQ(fault_of(file, {"v2", "left"}).substr(0, 15), "no_such_emitter");
    EXPECT_EQ(fault_of(file, {"v1", "e/3"}).substr(0, 15), "no_such_emitter");
    EXPECT_EQ(fault_of(file, {"v2", "eye"}).substr(0, 8), "no_light");
    EXPECT_EQ(read_photometry(file.lm63.text(), {"v1", ""}).error().code, "no_such_variant");
}

TEST(Gldf, WhatIsMissingIsNamed) {
    const auto changed = [](void (*change)(Gldf&)) {
        Gldf file;
        change(file);
        return fault_of(file);
    };
    EXPECT_EQ(changed([](Gldf& f) { f.files.replace(f.files.find("a.ies"), 5, "b.ies"); }),
              "missing_file, product.xml line 5 column 9, ldc/b.ies");
    EXPECT_EQ(changed([](Gldf& f) { f.files.replace(f.files.find("a.ies"), 5, "../a.ies"); }),
              "missing_file, product.xml line 5 column 9, ldc/../a.ies");
    EXPECT_EQ(changed([](Gldf& f) {
                  f.files = "<File id=\"ldc\" contentType=\"ldc/ies\" type=\"url\">https://example.org/a.ies</File>";
              }),
              "file_not_fetched, product.xml line 5 column 9, https://example.org/a.ies");
    EXPECT_EQ(changed([](Gldf& f) { f.photometries.clear(); }).substr(0, 17), "missing_reference");
    EXPECT_EQ(changed([](Gldf& f) { f.files.clear(); }).substr(0, 17), "missing_reference");
    EXPECT_EQ(changed([](Gldf& f) { f.geometry = "<EmitterReference emitterId=\"x\"/>"; }).substr(0, 17),
              "missing_reference");
    EXPECT_EQ(changed([](Gldf& f) { f.light = "<SensorEmitter/>"; }).substr(0, 8), "no_light");
    EXPECT_EQ(changed([](Gldf& f) {
                  f.geometry.clear();
                  f.more_emitters = "<Emitter id=\"e2\">" + f.light + "</Emitter>";
              }).substr(0, 10),
              "no_emitter")
        << "which of the two?";
    EXPECT_EQ(changed([](Gldf& f) {
                  f.geometry.clear();
                  f.light = "<SensorEmitter/>";
              }).substr(0, 10),
              "no_emitter");
    EXPECT_EQ(changed([](Gldf& f) { f.lm63.candela = "1 2"; }).substr(0, 20), "truncated, ldc/a.ies");
    EXPECT_EQ(changed([](Gldf& f) {
                  f.files.replace(f.files.find("a.ies"), 5, "b.ies");
                  f.more_files = {{"ldc/b.ies", zip_of({{"product.xml", "x"}})}};
              }).substr(0, 14),
              "unknown_format");
    EXPECT_EQ(read_photometry(zip_of({{"a.txt", "x"}})).error().code, "no_product");
    EXPECT_EQ(read_photometry(zip_of({{"product.xml", "<Other/>"}})).error().code, "unknown_root");
    EXPECT_EQ(read_photometry(zip_of({{"product.xml", "<Root/>"}})).error().code, "no_variant");
    EXPECT_EQ(read_photometry(zip_of({{"product.xml", "<Root>"}})).error().code, "bad_xml");
    EXPECT_EQ(read_photometry(zip_of({{"product.xml", "<!DOCTYPE a []><Root/>"}})).error().code, "xml_doctype");
    EXPECT_EQ(read_photometry(zip_of({{"product.xml", std::string(20u << 20, ' ')}})).error().code, "zip_ratio");
    Gldf dangling;
    dangling.light.replace(dangling.light.find("</Fixed"), 0, "<LightSourceReference fixedLightSourceId=\"x\"/>");
    EXPECT_TRUE(has(read_well(dangling), "missing_reference")) << "of what only tells watts and colour";
}

TEST(Gldf, NamesOfOtherCodePagesAndCase) {
    Gldf file;
    file.files.replace(file.files.find("a.ies"), 5, "A.IES");
    EXPECT_TRUE(has(read_well(file), "file_name"));
    file.more_files = {{"LDC/a.ies", "another file"}};
    EXPECT_TRUE(has(read_well(file), "case_clash"));
    // The archive's own name in code page 850, where 437 has other signs.
    file.files.replace(file.files.find("A.IES"), 5, "ä©§.ies");
    file.more_files = {{"ldc/xyz.ies", Lm63Text().text()}};
    std::string bytes = file.bytes();
    for (std::size_t at = bytes.find("xyz.ies"); at != std::string::npos; at = bytes.find("xyz.ies"))
        bytes.replace(at, 3, "\x84\xb8\xf5");
    const auto read = read_photometry(bytes);
    ASSERT_TRUE(read) << read.error().text();
    EXPECT_TRUE(has(*read, "file_name"));
}

// "ü" is one character in the product, and "u" with two dots in an archive that was packed on a Mac.
TEST(Gldf, AccentsMayBeSpeltOtherwise) {
    Gldf file;
    file.files.replace(file.files.find("a.ies"), 5, "gr\xc3\xbcn.ies");
    file.more_files = {{"ldc/gru\xcc\x88n.ies", Lm63Text().text()}};
    EXPECT_TRUE(has(read_well(file), "file_name"));
}

// A light that shines along C0 only, turned by 90 degrees.
TEST(Gldf, TurnsAboutTheVertical) {
    Gldf file;
    file.lm63.counts = "3 5";
    file.lm63.h = "0 90 180 270 360";
    file.lm63.candela = "9 8 7 9 0 0 9 0 0 9 0 0 9 8 7";
    const auto turned = [&](const char* rotation) {
        Gldf other = file;
        other.light.replace(other.light.find("<Photometry"), 0, "<Rotation>" + std::string(rotation) + "</Rotation>");
        return read_well(other);
    };
    const Photometry quarter = turned("<X>0</X><Y>0</Y><Z>90</Z><G0>0</G0>");
    EXPECT_TRUE(has(quarter, "rotated"));
    EXPECT_NEAR(at(quarter, 90, 90), 7.0, 1e-6);
    EXPECT_NEAR(at(quarter, 90, 0), 0.0, 1e-6);
    EXPECT_NEAR(flux_of(quarter), flux_of(read_well(file)), 1e-6);
    const Photometry odd = turned("<X>0</X><Y>0</Y><Z>30</Z><G0>0</G0>");
    EXPECT_NEAR(at(odd, 90, 30), 7.0, 1e-5);
    EXPECT_NEAR(flux_of(odd), flux_of(read_well(file)), 1e-5);
    const Photometry tilted = turned("<X>90</X><Y>0</Y><Z>0</Z><G0>0</G0>");
    EXPECT_TRUE(has(tilted, "rotation_not_applied"));
    EXPECT_EQ(tilted.web, read_well(file).web);
    EXPECT_FALSE(has(turned("<X>0</X><Y>360</Y><Z>0</Z><G0>0</G0>"), "rotation_not_applied"));
}

std::string l3d_of(const std::string& objects) {
    return zip_of({{"structure.xml",
                    "<Luminaire><Structure><Geometry partName=\"body\"><Rotation x=\"0\" y=\"0\" z=\"90\"/>"
                    "<Joints><Joint><Geometries><Geometry partName=\"head\"><LightEmittingObjects>" +
                        objects +
                        "</LightEmittingObjects></Geometry></Geometries></Joint></Joints></Geometry>"
                        "</Structure></Luminaire>"}});
}

TEST(Gldf, OpeningsOfGeometries) {
    Gldf file;
    file.geometries =
        "<SimpleGeometry id=\"box\"><Cuboid/><RectangularEmitter><Width>300</Width><Length>1200</Length>"
        "</RectangularEmitter></SimpleGeometry><SimpleGeometry id=\"can\"><CircularEmitter><Diameter>180</Diameter>"
        "</CircularEmitter><C-Heights><C0>0</C0><C90>20</C90><C180>0</C180><C270>0</C270></C-Heights></SimpleGeometry>"
        "<ModelGeometry id=\"model\"><GeometryFileReference fileId=\"l3d\"/></ModelGeometry>";
    file.files += "<File id=\"l3d\" contentType=\"geo/l3d\" type=\"localFileName\">g.l3d</File>";
    file.lm63.size = "0.5 0.5 0";
    EXPECT_EQ(read_well(file).opening.length.in(m), 0.5) << "the photometric file's";
    file.geometry = "<SimpleGeometryReference geometryId=\"box\" emitterId=\"e\"/>";
    EXPECT_EQ(read_well(file).opening, (Opening{OpeningShape::rectangle, 0.3 * m, 1.2 * m, 0.0 * m}));
    file.geometry = "<SimpleGeometryReference geometryId=\"can\" emitterId=\"e\"/>";
    EXPECT_EQ(read_well(file).opening, (Opening{OpeningShape::vertical_cylinder, 0.18 * m, 0.18 * m, 0.02 * m}));

    file.geometry =
        "<GeometryReferences><SimpleGeometryReference geometryId=\"box\" emitterId=\"e\"/><ModelGeometryReference "
        "geometryId=\"model\"><EmitterReference emitterId=\"e\"><EmitterObjectExternalName>led"
        "</EmitterObjectExternalName></EmitterReference></ModelGeometryReference></GeometryReferences>";
    EXPECT_TRUE(has(read_well(file), "geometry_not_read")) << "the model is not in the archive";
    EXPECT_EQ(read_well(file).opening.length.in(m), 1.2) << "so the simple geometry's";
    const std::string other = "<LightEmittingObject partName=\"x\"><Circle diameter=\"9\"/></LightEmittingObject>";
    file.more_files = {{"geo/g.l3d", l3d_of(other + "<LightEmittingObject partName=\"led\"><Rotation x=\"0\" y=\"0\" "
                                                    "z=\"-90\"/><Rectangle sizeX=\"0.2\" sizeY=\"1.1\"/>"
                                                    "</LightEmittingObject>")}};
    EXPECT_EQ(read_well(file).opening, (Opening{OpeningShape::rectangle, 0.2 * m, 1.1 * m, 0.0 * m}));
    file.more_files = {{"geo/g.l3d", l3d_of(other + "<LightEmittingObject partName=\"led\"><Rectangle sizeX=\"0.2\" "
                                                    "sizeY=\"1.1\"/></LightEmittingObject>")}};
    EXPECT_EQ(read_well(file).opening.width.in(m), 1.1) << "turned by the body's 90 degrees";
    file.more_files = {{"geo/g.l3d", l3d_of("<LightEmittingObject partName=\"a\"><Circle diameter=\"0.07\"/>"
                                            "</LightEmittingObject>")}};
    EXPECT_EQ(read_well(file).opening, (Opening{OpeningShape::ellipse, 0.07 * m, 0.07 * m, 0.0 * m})) << "the only one";
    file.more_files = {{"geo/g.l3d", l3d_of("<LightEmittingObject><Circle diameter=\"nan\"/></LightEmittingObject>")}};
    EXPECT_TRUE(has(read_well(file), "geometry_not_read"));
    file.more_files = {{"geo/g.l3d", "no archive"}};
    EXPECT_TRUE(has(read_well(file), "geometry_not_read"));
}

TEST(Gldf, ManyVariantsAndLights) {
    Gldf file;
    for (int i = 0; i < 20'000; ++i) {
        file.more_variants +=
            printed("<Variant id=\"w%d\"><Geometry><EmitterReference emitterId=\"m%d\"/></Geometry></Variant>", i, i);
        file.more_emitters += printed("<Emitter id=\"m%d\"/>", i);
        file.geometry += printed("<EmitterReference emitterId=\"m%d\"/>", i);
    }
    const Photometry read = read_well(file);
    for (const Diagnostic& diagnostic : read.diagnostics) EXPECT_LT(diagnostic.message.size(), 1000u);
    EXPECT_EQ(fault_of(file, {"w19999", ""}).substr(0, 8), "no_light");
}

struct Sample {
    const char* code;  // of the error; "" where it is read
    const char* where;
    double flux_lm;
    const char* diagnostic;
};

// What product.xml and the archive's list of each sample say.
TEST(Gldf, TheSharedSamples) {
    const auto corpus = gonio::test::shared_data("photometry");
    if (!corpus) GTEST_SKIP() << "no shared data";
    const std::map<std::string, Sample> expected = {
        // The archive has Äöü°§.ldt, product.xml asks for Äöü.ldt.
        {"GldfWithCodepage850.gldf", {"missing_file", "product.xml line 14", 0, ""}},
        {"GldfWithEncodingUtf8.gldf", {"missing_file", "product.xml line 14", 0, ""}},
        {"GldfWithFiles.gldf", {"no_variant", "product.xml line 2", 0, ""}},
        // 6,300 lm in the file, light output ratio 0.6426 by its intensities; a lamp of 800 lm in the product.
        {"GldfWithFilesComplete.gldf", {"", "", 800 * 0.6426, "rotation_not_applied"}},
        {"GldfWithHeaderMandatory.gldf", {"file_not_fetched", "product.xml line 12", 0, ""}},
        {"GldfWithInvalidRoot.gldf", {"file_not_fetched", "product.xml line 12", 0, ""}},
        {"GldfWithLargeFiles.gldf", {"file_not_fetched", "product.xml line 12", 0, ""}},
        {"GldfWithMetaInfo.gldf", {"no_emitter", "product.xml", 0, ""}},
        {"GldfWithMissingFiles.gldf", {"missing_file", "product.xml line 12", 0, ""}},
        {"GldfWithMissingProduct.gldf", {"no_product", "product.xml", 0, ""}},
        {"GldfWithNoFiles.gldf", {"file_not_fetched", "product.xml line 12", 0, ""}},
        {"GldfWithOrphanedFiles.gldf", {"empty_file", "ldc/file.ldt", 0, ""}},  // of 0 bytes
    };
    std::size_t seen = 0;
    for (const auto& entry : std::filesystem::directory_iterator(*corpus / "../formats/gldf")) {
        const std::string name = entry.path().filename();
        if (entry.path().extension() != ".gldf" || name.starts_with("LICENSE")) continue;
        ++seen;
        const auto row = expected.find(name);
        ASSERT_NE(row, expected.end()) << name << " has no row";
        const auto read = read_photometry(test::read_file(entry.path()));
        EXPECT_EQ(read ? "" : read.error().code, row->second.code) << name;
        if (!read) {
            EXPECT_TRUE(read.error().where.starts_with(row->second.where)) << name << ": " << read.error().where;
            continue;
        }
        EXPECT_NEAR(flux_of(*read), row->second.flux_lm, 1e-3 * row->second.flux_lm) << name;
        EXPECT_TRUE(has(*read, row->second.diagnostic)) << name;
    }
    EXPECT_EQ(seen, expected.size());
}

TEST(Gldf, TheCompleteSamplesModel) {
    const auto corpus = gonio::test::shared_data("photometry");
    if (!corpus) GTEST_SKIP() << "no shared data";
    const auto read =
        read_photometry(test::read_file(*corpus / "../formats/gldf/GldfWithFilesComplete.gldf"), {"variant-2", "LEO"});
    ASSERT_TRUE(read) << read.error().text();
    // sizeX 0.17, sizeY 1.17; its turn by −90 degrees undoes the body's 90.
    EXPECT_EQ(read->opening, (Opening{OpeningShape::rectangle, 0.17 * m, 1.17 * m, 0.0 * m}));
    EXPECT_EQ(read->provenance.input_watts, 110.0) << "of equipment-1";
}

}  // namespace
}  // namespace gonio::ies

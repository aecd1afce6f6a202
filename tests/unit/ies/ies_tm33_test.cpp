// TM-33: expected values are closed forms of the webs that the tests write, and what the file was made to say.
#include "ies/tm33.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "ies/core/printed.h"
#include "ies/eulumdat.h"
#include "ies/photometry_file.h"
#include "ies/synthetic.h"
#include "ies/writers.h"
#include "tests/shared_data.h"
#include "tests/unit/angles.h"
#include "tests/unit/ies_test_support.h"

namespace gonio::ies {
namespace {

using test::at;
using test::has;

// The parts of a TM-33-22 file; each test changes the one it is about.
struct Tm33Text {
    std::string root = "IESTM33-22";
    std::string header =
        "<Header><Description>d</Description><Laboratory>l</Laboratory><ReportNumber>1</ReportNumber>"
        "<ReportDate>2024-02-29</ReportDate></Header>\n";
    std::string luminaire;
    std::string type = "IES_C";
    std::string lamp = "<Quantity>1</Quantity><Description>LED</Description><InputWattage>40</InputWattage>\n";
    std::string facts = "<AbsolutePhotometry>true</AbsolutePhotometry>\n";
    std::string data =
        "<IntData h=\"0\" v=\"0\">100</IntData>\n<IntData h=\"0\" v=\"45\">50</IntData>\n"
        "<IntData h=\"0\" v=\"90\">0</IntData>\n";
    std::string after;  // what follows LuminousIntensity
    std::string areas;
    std::string more;  // emitters

    std::string text() const {
        const std::string equipment =
            type.empty() ? "" : "<Equipment><Gonioradiometer><Type>" + type + "</Type></Gonioradiometer></Equipment>\n";
        return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<" + root + ">\n<Version>1.1</Version>\n" + header +
               luminaire + equipment + "<Emitter>" + lamp + "<LuminousData><LuminousIntensity>" + facts + data +
               "</LuminousIntensity>" + after + "</LuminousData>" + areas + "</Emitter>\n" + more + "</" + root + ">\n";
    }
};

Photometry read_well(const std::string& text, const Choice& choice = {}) {
    auto read = read_tm33(text, choice);
    EXPECT_TRUE(read) << (read ? "" : read.error().text());
    return read ? *read : Photometry{};
}

std::string fault_of(const std::string& text, const Choice& choice = {}) {
    const auto read = read_tm33(text, choice);
    return read ? "" : read.error().code + " " + read.error().where;
}

double flux_of(const Photometry& photometry) {
    return total_flux(photometry.web).in(lm);
}

std::string points(double h_first, double h_last, double h_step, double v_first, double v_last, double v_step,
                   const std::function<double(double, double)>& candela) {
    std::string text;
    for (double h = h_first; h <= h_last + 1e-9; h += h_step)
        for (double v = v_first; v <= v_last + 1e-9; v += v_step)
            text +=
                printed("<IntData h=\"%g\" v=\"%g\">%.9g</IntData>\n", h, v, candela(h * kPi / 180.0, v * kPi / 180.0));
    return text;
}

TEST(Tm33, TheSharedSample) {
    const auto corpus = gonio::test::shared_data("photometry");
    if (!corpus) GTEST_SKIP() << "no shared data";
    const auto read = read_photometry(test::read_file(*corpus / "../formats/tm33-minimal-own.xml"));
    ASSERT_TRUE(read) << read.error().text();
    // Linear in the angle between 1000 cos(v) at 0, 30, 60 and 90 degrees; the cosine itself has 1000 pi.
    EXPECT_NEAR(flux_of(*read), 3067.796, 0.001);
    EXPECT_EQ(peak_intensity(read->web).in(cd), 1000.0);
    EXPECT_EQ(at(*read, 60, 123), 500.0);
    EXPECT_TRUE(read->provenance.absolute);
    EXPECT_EQ(read->provenance.format, "TM-33-22");
    EXPECT_EQ(read->provenance.multiplier, 2.0);
    EXPECT_EQ(read->provenance.input_watts, 30.0);
    EXPECT_EQ(read->provenance.symmetry, Symmetry::axial);
    EXPECT_EQ(read->opening.shape, OpeningShape::rectangle);
    EXPECT_EQ(read->opening.length.in(m), 0.6);
    EXPECT_EQ(test::warnings(*read), 0);
    EXPECT_TRUE(has(*read, "opening_from_dimensions"));
}

TEST(Tm33, CosineHasPiTimesItsPeak) {
    Tm33Text file;
    file.facts = "<AbsolutePhotometry>true</AbsolutePhotometry><Symm>Symm_Full</Symm><Multiplier>4</Multiplier>";
    file.data = points(0, 0, 1, 0, 90, 1, [](double, double v) { return 250.0 * std::cos(v); });
    const Photometry read = read_well(file.text());
    EXPECT_NEAR(flux_of(read), 1000.0 * kPi, 0.1);
    EXPECT_EQ(test::warnings(read), 0);
    EXPECT_EQ(read.provenance.input_watts, 40.0);
}

// I = 1000 (1 + cos² h) cos v: its flux is 1000 · 3 pi · 1/2, whichever part of it a file gives.
TEST(Tm33, SymmetriesUnfold) {
    const auto candela = [](double h, double v) { return 1000.0 * (1.0 + std::cos(h) * std::cos(h)) * std::cos(v); };
    struct Case {
        const char* symm;
        double from, to;
        Symmetry expected;
    };
    for (const auto& [symm, from, to, expected] : {Case{"Symm_Quad", 0, 90, Symmetry::quadrant},
                                                   {"Symm_Bi_0", 0, 180, Symmetry::bilateral_0_180},
                                                   {"Symm_Bi_90", 90, 270, Symmetry::bilateral_90_270},
                                                   {"Symm_Bi_90", -90, 90, Symmetry::bilateral_90_270},
                                                   {"Symm _ Quad", 0, 90, Symmetry::quadrant},
                                                   {"Symm_None", 0, 360, Symmetry::none},
                                                   {"Symm_Arbitrary", 0, 360, Symmetry::none},
                                                   {"", 0, 180, Symmetry::bilateral_0_180}}) {
        Tm33Text file;
        if (*symm) file.facts += "<Symm>" + std::string(symm) + "</Symm>";
        file.data = points(from, to, 2.5, 0, 90, 2.5, candela);
        for (const char* type : {"IES_C", "CIE_C"}) {
            file.type = type;
            const Photometry read = read_well(file.text());
            EXPECT_NEAR(flux_of(read), 1500.0 * kPi, 3.0) << symm << from;
            EXPECT_EQ(read.provenance.symmetry, expected) << symm << from;
            const double along = *type == 'I' ? 0.0 : 90.0;  // C0 lies along the length or across it
            EXPECT_NEAR(at(read, 30, along), 2000.0 * std::cos(kPi / 6), 1e-3) << symm << type;
            EXPECT_NEAR(at(read, 30, along + 180.0), 2000.0 * std::cos(kPi / 6), 1e-3) << symm << type;
            EXPECT_NEAR(at(read, 30, along + 90.0), 1000.0 * std::cos(kPi / 6), 1e-3) << symm << type;
        }
    }
}

// A light that leans to C90, given as 0–90 and 270–360.
TEST(Tm33, TwoPartsOfABilateralWeb) {
    const auto candela = [](double h, double v) { return 100.0 * (2.0 + std::sin(h)) * std::cos(v); };
    Tm33Text file;
    file.facts += "<Symm>Symm_Bi_90</Symm>";
    file.data = points(0, 90, 15, 0, 90, 5, candela) + points(270, 360, 15, 0, 90, 5, candela);
    const Photometry read = read_well(file.text());
    EXPECT_EQ(read.provenance.symmetry, Symmetry::bilateral_90_270);
    EXPECT_NEAR(at(read, 60, 90), 150.0, 1e-3);
    EXPECT_NEAR(at(read, 60, 270), 50.0, 1e-3);
    EXPECT_NEAR(at(read, 60, 150), 125.0, 1e-3) << "as at 30";
    // ∫(2 + sin h) dh = 4 pi, ∫cos v sin v dv = 1/2.
    EXPECT_NEAR(flux_of(read), 200.0 * kPi, 0.5);
}

TEST(Tm33, AzimuthsOfLm63AndOfEulumdat) {
    const auto candela = [](double h, double v) { return 100.0 * (2.0 + std::cos(h)) * std::sin(v); };
    Tm33Text file;
    file.data = points(0, 180, 15, 0, 90, 15, candela);
    EXPECT_NEAR(at(read_well(file.text()), 90, 0), 300.0, 1e-3);
    file.type = "CIE_C";
    const Photometry across = read_well(file.text());
    EXPECT_NEAR(at(across, 90, 270), 300.0, 1e-3) << "C0 lies across the luminaire, at h = -90";
    EXPECT_NEAR(at(across, 90, 90), 100.0, 1e-3);
    EXPECT_DOUBLE_EQ(across.provenance.zero_plane_rad, 1.5 * kPi);
    file.type = "";
    EXPECT_TRUE(has(read_well(file.text()), "goniometer_type"));
    EXPECT_NEAR(at(read_well(file.text()), 90, 270), 300.0, 1e-3);
}

// Lambert's law about (0,0): in Types A and B cos v cos h. Its flux is pi times the peak.
TEST(Tm33, TypesAAndB) {
    Tm33Text file;
    file.data =
        points(-90, 90, 2.5, -90, 90, 2.5, [](double h, double v) { return 100.0 * std::cos(v) * std::cos(h); });
    for (const char* type : {"IES_A", "IES_B", "CIE_A", "CIE_B"}) {
        file.type = type;
        const Photometry read = read_well(file.text());
        EXPECT_EQ(read.web.goniometer, type[4] == 'A' ? Goniometer::type_a : Goniometer::type_b);
        EXPECT_NEAR(flux_of(read), 100.0 * kPi, 0.2) << type;
        EXPECT_NEAR(intensity(read.web, {0.0, 0.0, -1.0}).in(cd), 100.0, 1e-4) << type;
    }
}

TEST(Tm33, RelativePhotometry) {
    Tm33Text file;
    file.lamp =
        "<Quantity>2</Quantity><Description>T5</Description><RatedLumens>500</RatedLumens>"
        "<InputWattage>80</InputWattage><BallastFactor>0.9</BallastFactor>";
    file.facts = "<AbsolutePhotometry>false</AbsolutePhotometry><Multiplier>10</Multiplier>";
    const Photometry read = read_well(file.text());
    EXPECT_EQ(peak_intensity(read.web).in(cd), 900.0F);
    EXPECT_FALSE(read.provenance.absolute);
    EXPECT_EQ(read.provenance.rated_lumens, 1000.0);
    EXPECT_EQ(read.provenance.lumens_per_lamp, 500.0);
    EXPECT_TRUE(has(read, "relative_base") && has(read, "quantity"));
    file.facts = "<AbsolutePhotometry>true</AbsolutePhotometry>";
    EXPECT_EQ(peak_intensity(read_well(file.text()).web).in(cd), 100.0) << "what was measured had its ballast";
    EXPECT_TRUE(has(read_well(file.text()), "ballast_factor"));
    file.lamp = "<Quantity>1</Quantity><Description/><InputWattage>0</InputWattage>";
    file.facts = "<AbsolutePhotometry>0</AbsolutePhotometry>";
    EXPECT_TRUE(has(read_well(file.text()), "zero_lumens"));
    EXPECT_TRUE(read_well(file.text()).provenance.absolute);
}

// The names of eulumdat-rs: candela per kilolumen, millimetres.
TEST(Tm33, OtherNames) {
    const std::string data =
        "<IntensityData horz=\"0\" vert=\"0\">136</IntensityData><IntensityData horz=\"0\" "
        "vert=\"90\">1</IntensityData>"
        "<IntensityData horz=\"90\" vert=\"0\">136</IntensityData><IntensityData horz=\"90\" "
        "vert=\"90\">1</IntensityData>";
    const std::string text =
        "<LuminaireOpticalData version=\"1.0\"><Header><Manufacturer>M</Manufacturer></Header><Luminaire><Dimensions>"
        "<Length>1170</Length><Width>90</Width><Height>80</Height></Dimensions></Luminaire><Emitter>"
        "<Quantity>2</Quantity><RatedLumens>8100</RatedLumens><InputWatts>120</InputWatts><CCT>6500</CCT>"
        "<IntensityDistribution><PhotometryType>C</PhotometryType><Metric>Luminous</Metric>" +
        data + "</IntensityDistribution></Emitter></LuminaireOpticalData>";
    const auto read = read_photometry(text);
    ASSERT_TRUE(read) << read.error().text();
    EXPECT_NEAR(peak_intensity(read->web).in(cd), 136 * 8.1, 1e-3);
    EXPECT_EQ(read->provenance.rated_lumens, 8100.0);
    EXPECT_EQ(read->provenance.input_watts, 120.0);
    EXPECT_EQ(read->opening.length.in(m), 1.17);
    EXPECT_TRUE(has(*read, "other_names"));
    Tm33Text file;
    file.type = "CIE _ C";
    std::string mixed = file.text();
    mixed.replace(mixed.find("<LuminousIntensity>"),
                  mixed.find("</LuminousIntensity>") + 20 - mixed.find("<LuminousIntensity>"),
                  "<PhotometryType>CIE _ C</PhotometryType><Metric>Luminous</Metric><SymmType>Symm _ Quad</SymmType>"
                  "<Multiplier>3</Multiplier>" +
                      data);
    EXPECT_EQ(peak_intensity(read_well(mixed).web).in(cd), 408.0) << "no rated lumens: absolute";
    EXPECT_EQ(read_well(mixed).provenance.symmetry, Symmetry::quadrant);
}

TEST(Tm33, SeveralEmitters) {
    Tm33Text file;
    file.more =
        "<Emitter><Quantity>1</Quantity><Description>amber</Description><CatalogNumber>K7</CatalogNumber>"
        "<InputWattage>5</InputWattage><LuminousData><LuminousIntensity><IntData h=\"0\" v=\"0\">7</IntData>"
        "<IntData h=\"0\" v=\"90\">0</IntData></LuminousIntensity></LuminousData></Emitter>";
    EXPECT_TRUE(has(read_well(file.text()), "emitters"));
    EXPECT_EQ(peak_intensity(read_well(file.text()).web).in(cd), 100.0);
    for (const char* name : {"2", "amber", "K7"}) {
        EXPECT_EQ(peak_intensity(read_well(file.text(), {"", name}).web).in(cd), 7.0) << name;
        EXPECT_EQ(read_well(file.text(), {"", name}).provenance.input_watts, 5.0) << name;
    }
    EXPECT_EQ(fault_of(file.text(), {"", "red"}), "no_such_emitter line 2 column 2");
    EXPECT_EQ(fault_of(file.text(), {"b", ""}), "no_such_variant line 2 column 2");
}

TEST(Tm33, KeywordsAndWhatElseIsStated) {
    Tm33Text file;
    file.header =
        "<Header><Manufacturer>A &amp; B</Manufacturer><CatalogNumber>C-1</CatalogNumber><Description>d</Description>"
        "<Laboratory>l</Laboratory><ReportNumber>r</ReportNumber><ReportDate>2024-02-29</ReportDate>"
        "<Comment>one</Comment><Comment>two</Comment></Header>";
    file.lamp +=
        "<ColorTemperature><FixedCCT>3000</FixedCCT></ColorTemperature><ColorRendering><CIE_CRI><Ra>90</Ra></CIE_CRI>"
        "</ColorRendering>";
    file.after = "<LuminousFlux>100</LuminousFlux>";
    file.facts += "<NumberMeasured>3</NumberMeasured><NumberHorz>1</NumberHorz><NumberVert>4</NumberVert>";
    const Photometry read = read_well(file.text());
    const std::vector<std::pair<std::string, std::string>> expected = {
        {"MANUFAC", "A & B"}, {"LUMCAT", "C-1"},           {"LUMINAIRE", "d"}, {"TESTLAB", "l"},
        {"TEST", "r"},        {"ISSUEDATE", "2024-02-29"}, {"OTHER", "one"},   {"OTHER", "two"},
        {"LAMP", "LED"},      {"_COLORTEMP", "3000"},      {"_CRI", "90"}};
    EXPECT_EQ(read.provenance.keywords, expected);
    EXPECT_TRUE(has(read, "count_mismatch")) << "four vertical angles are announced, three are there";
    EXPECT_TRUE(has(read, "flux_mismatch")) << "of 100 lm; the web has more";
    Tm33Text of_2018;
    of_2018.root = "IESTM33";
    of_2018.after = "<MeasuredCCT>2980</MeasuredCCT>";
    const Photometry old = read_well(of_2018.text());
    EXPECT_EQ(old.provenance.format, "TM-33-18");
    EXPECT_EQ(old.provenance.keywords.back().second, "2980");
}

TEST(Tm33, Openings) {
    const auto opening = [](const std::string& areas, const std::string& luminaire = "") {
        Tm33Text file;
        file.areas = areas.empty() ? "" : "<EmissionAreas>" + areas + "</EmissionAreas>";
        file.luminaire = luminaire;
        return read_well(file.text()).opening;
    };
    const std::string at_0 = "<LengthOffset>0</LengthOffset><WidthOffset>0</WidthOffset>";
    const std::string bottom =
        "<BottomFace><NumberBottom>1</NumberBottom><BottomArea><Length>1.2</Length>"
        "<Width>0.3</Width>" +
        at_0 + "</BottomArea></BottomFace>";
    const std::string side =
        "<C0Face><NumberC0>1</NumberC0><C0Area><Length>1.2</Length><Height>0.05</Height>"
        "<LengthOffset>0</LengthOffset><HeightOffset>0</HeightOffset></C0Area></C0Face>";
    const std::string round = "<BottomFace><BottomArea><Length>0.2</Length><Width>0.2</Width>" + at_0 +
                              "<Circular>true</Circular></BottomArea></BottomFace>";
    EXPECT_EQ(opening(""), Opening{});
    EXPECT_EQ(opening(bottom), (Opening{OpeningShape::rectangle, 0.3 * m, 1.2 * m, 0.0 * m}));
    EXPECT_EQ(opening(bottom + side), (Opening{OpeningShape::box, 0.3 * m, 1.2 * m, 0.05 * m}));
    EXPECT_EQ(opening(round), (Opening{OpeningShape::ellipse, 0.2 * m, 0.2 * m, 0.0 * m}));
    EXPECT_EQ(opening(round + side).shape, OpeningShape::vertical_cylinder);
    const std::string dimensions =
        "<Luminaire><Dimensions><Length>1500</Length><Width>100</Width><Height>60</Height></Dimensions></Luminaire>";
    EXPECT_EQ(opening("", dimensions), (Opening{OpeningShape::rectangle, 0.1 * m, 1.5 * m, 0.0 * m})) << "millimetres";
    EXPECT_EQ(opening(bottom, dimensions).length.in(m), 1.2);
    const Opening two = opening(
        "<BottomFace><BottomArea><Length>1</Length><Width>0.2</Width><LengthOffset>-1</LengthOffset>"
        "<WidthOffset>0</WidthOffset></BottomArea><BottomArea><Length>1</Length><Width>0.2</Width>"
        "<LengthOffset>1</LengthOffset><WidthOffset>0</WidthOffset></BottomArea></BottomFace>");
    EXPECT_EQ(two.length.in(m), 3.0);
}

TEST(Tm33, PointsInAnyOrderAndPolesGivenOnce) {
    Tm33Text file;
    file.data =
        "<IntData v=\"90\" h=\"90\">4</IntData><IntData h=\"0\" v=\"90\">2</IntData><IntData h=\"0\" "
        "v=\"0\">9</IntData>"
        "<IntData h=\"90\" v=\"45\">5</IntData><IntData h=\"0\" v=\"45\">3</IntData>";
    const Photometry read = read_well(file.text());
    EXPECT_TRUE(has(read, "pole_once"));
    EXPECT_EQ(read.provenance.symmetry, Symmetry::quadrant);
    EXPECT_NEAR(at(read, 45, 90), 5.0, 1e-9);
    EXPECT_NEAR(at(read, 0, 90), 9.0, 1e-9);
    EXPECT_NEAR(at(read, 90, 0), 2.0, 1e-9);
}

TEST(Tm33, Errors) {
    struct Case {
        const char* expected;
        void (*change)(Tm33Text&);
    };
    const Case cases[] = {
        {"unknown_root line 2 column 2", [](Tm33Text& f) { f.root = "Root"; }},
        {"not_a_number line 9 column 2", [](Tm33Text& f) { f.data.replace(f.data.find(">50<"), 4, ">5o<"); }},
        {"not_finite line 9 column 2", [](Tm33Text& f) { f.data.replace(f.data.find(">50<"), 4, ">nan<"); }},
        {"not_finite line 9 column 2", [](Tm33Text& f) { f.data.replace(f.data.find(">50<"), 4, ">-inf<"); }},
        {"not_finite line 9 column 2", [](Tm33Text& f) { f.data.replace(f.data.find(">50<"), 4, ">1e999<"); }},
        {"not_a_number line 9 column 2", [](Tm33Text& f) { f.data.replace(f.data.find(">50<"), 4, ">&big;<"); }},
        {"not_a_number line 9 column 2", [](Tm33Text& f) { f.data.replace(f.data.find(">50<"), 4, "><"); }},
        {"not_a_number line 9 column 2", [](Tm33Text& f) { f.data.replace(f.data.find(">50<"), 4, ">2,5<"); }},
        {"candela_too_large line 9 column 2", [](Tm33Text& f) { f.data.replace(f.data.find(">50<"), 4, ">2e12<"); }},
        {"not_finite line 9 column 2", [](Tm33Text& f) { f.data.replace(f.data.find("v=\"45\""), 6, "v=\"inf\""); }},
        {"missing_angle line 9 column 2", [](Tm33Text& f) { f.data.replace(f.data.find("v=\"45\""), 6, ""); }},
        {"duplicate_value line 9 column 2", [](Tm33Text& f) { f.data.replace(f.data.find("v=\"45\""), 6, "v=\"0\""); }},
        {"incomplete_grid line 7 column 16",
         [](Tm33Text& f) { f.data.replace(f.data.find("h=\"0\" v=\"45\""), 12, "h=\"1\" v=\"45\""); }},
        {"angle_out_of_range line 7 column 16",
         [](Tm33Text& f) { f.data.replace(f.data.find("v=\"45\""), 6, "v=\"181\""); }},
        {"bad_symmetry line 7 column 35", [](Tm33Text& f) { f.facts = "<Symm>Symm_Half</Symm>\n"; }},
        {"bad_type line 5 column 30", [](Tm33Text& f) { f.type = "CIE_D"; }},
        {"no_intensities line 7 column 2", [](Tm33Text& f) { f.data.clear(); }},
        {"not_a_number line 7 column 35", [](Tm33Text& f) { f.facts = "<Multiplier>x</Multiplier>\n"; }},
    };
    for (const auto& [expected, change] : cases) {
        Tm33Text file;
        change(file);
        EXPECT_EQ(fault_of(file.text()), expected);
    }
    EXPECT_EQ(fault_of(""), "empty_file line 1 column 1");
    EXPECT_EQ(fault_of("<IESTM33-22/>"), "no_emitter line 1 column 2");
    EXPECT_EQ(fault_of("<IESTM33-22>\n<Emitter/></IESTM33-22>"), "no_luminous_data line 2 column 2");
    EXPECT_EQ(fault_of("<IESTM33-22>\n<Emitter>\n</IESTM33-22>").substr(0, 14), "bad_xml line 3");
}

// What one who means harm sends: each is one error, soon.
TEST(Tm33, HostileFiles) {
    EXPECT_EQ(fault_of("<!DOCTYPE x [<!ENTITY a \"aaaa\"><!ENTITY b \"&a;&a;\">]><IESTM33-22>&b;</IESTM33-22>"),
              "xml_doctype line 1 column 1");
    std::string wide = "<IESTM33-22>";
    for (int i = 0; i < 1'000'000; ++i) wide += "<a/>";
    EXPECT_EQ(fault_of(wide + "</IESTM33-22>"), "no_emitter line 1 column 2");
    for (int i = 0; i < 1'200'000; ++i) wide += "<a/>";
    EXPECT_EQ(fault_of(wide + "</IESTM33-22>"), "too_many_elements line 1 column 1");
    std::string deep = "<IESTM33-22>";
    for (int i = 0; i < 300'000; ++i) deep += "<Emitter>";
    EXPECT_EQ(fault_of(deep).substr(0, 7), "bad_xml");
    for (int i = 0; i < 300'000; ++i) deep += "</Emitter>";
    EXPECT_EQ(fault_of(deep + "</IESTM33-22>"), "no_luminous_data line 1 column 14");
    // 3,000 directions whose angles are all different: nine million cells.
    Tm33Text file;
    file.data.clear();
    for (int i = 0; i < 3000; ++i) file.data += printed("<IntData h=\"%g\" v=\"%g\">1</IntData>", i * 0.1, i * 0.05);
    EXPECT_EQ(fault_of(file.text()).substr(0, 14), "grid_too_large");
    EXPECT_EQ(fault_of(std::string(kMaxFileBytes + 1, ' ')).substr(0, 9), "too_large");
}

TEST(Tm33, OtherEncodings) {
    const std::string text = Tm33Text().text();
    std::string utf16 = "\xff\xfe";
    for (const char c : text) utf16 += {c, '\0'};
    EXPECT_EQ(read_photometry(utf16)->web, read_well(text).web);
    EXPECT_EQ(read_photometry("\xef\xbb\xbf" + text)->web, read_well(text).web);
    Tm33Text latin;
    latin.header = "<Header><Manufacturer>M\xfcller</Manufacturer></Header>";
    EXPECT_EQ(read_well(latin.text()).provenance.keywords.front().second, "Müller");
}

TEST(Tm33, RadiantIntensitiesAreNoCandela) {
    Tm33Text file;
    std::string text = file.text();
    for (const auto& [from, to] : {std::pair<std::string, std::string>{"LuminousData", "RadiantData"},
                                   {"LuminousIntensity", "RadiantIntensity"}})
        for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from))
            text.replace(at, from.size(), to);
    EXPECT_TRUE(read_well(text).provenance.radiometric);
    EXPECT_TRUE(has(read_well(text), "radiometric"));
}

void expect_round_trip(const Photometry& first, const std::string& name) {
    const std::string text = write_tm33(first);
    const auto again = read_photometry(text);
    ASSERT_TRUE(again) << name << ": " << again.error().text();
    EXPECT_EQ(again->web.goniometer, first.web.goniometer) << name;
    EXPECT_EQ(again->web.candela, first.web.candela) << name << ": to the last bit";
    ASSERT_EQ(again->web.v_rad.size(), first.web.v_rad.size()) << name;
    ASSERT_EQ(again->web.h_rad.size(), first.web.h_rad.size()) << name;
    for (std::size_t i = 0; i < first.web.v_rad.size(); ++i)
        EXPECT_NEAR(again->web.v_rad[i], first.web.v_rad[i], 1e-10);
    for (std::size_t i = 0; i < first.web.h_rad.size(); ++i)
        EXPECT_NEAR(again->web.h_rad[i], first.web.h_rad[i], 1e-10);
    EXPECT_EQ(again->provenance.absolute, first.provenance.absolute) << name;
    EXPECT_NEAR(again->provenance.rated_lumens, first.provenance.rated_lumens, 1e-9 * first.provenance.rated_lumens);
    EXPECT_EQ(again->provenance.input_watts, first.provenance.input_watts) << name;
    const bool box = first.opening.shape == OpeningShape::ellipsoid;  // TM-33's areas are flat
    EXPECT_EQ(again->opening.shape, box ? OpeningShape::box : first.opening.shape) << name;
    EXPECT_EQ(again->opening.length, first.opening.length) << name;
    EXPECT_EQ(again->tilt, first.tilt) << name;
    for (const auto& keyword : first.provenance.keywords)
        EXPECT_NE(std::ranges::find(again->provenance.keywords, keyword), again->provenance.keywords.end())
            << name << ": " << keyword.first;
    EXPECT_FALSE(has(*again, "flux_mismatch")) << name;
}

TEST(Tm33, WritesWhatItReads) {
    for (const SyntheticLuminaire& luminaire : synthetic_luminaires())
        expect_round_trip(*read_photometry(synthetic_lm63(std::string(luminaire.name))), std::string(luminaire.name));
    test::Lm63Text text;
    text.counts = "3 3";
    text.h = "-10 0 20";
    text.v = "-5 0 5";
    text.candela = "1.25e-7 2 3 0.1 0.3 4 5 6 1e11";
    for (const char* type : {"2 2", "3 2"}) {
        text.type = type;
        expect_round_trip(*read_photometry(text.text()), type);
    }
    test::Lm63Text tilted;
    tilted.tilt = "TILT=INCLUDE\n1\n3\n0 45 90\n1 0.95 0.9\n";
    tilted.lamps = "2 1000 3";
    tilted.size = "-0.2 -0.2 0.1";
    expect_round_trip(*read_photometry(tilted.text()), "tilt");
}

TEST(Tm33, TheCorpusSurvivesWriting) {
    const auto corpus = gonio::test::shared_data("photometry");
    if (!corpus) GTEST_SKIP() << "no shared data";
    std::size_t files = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(*corpus / "ldt")) {
        if (!entry.is_regular_file() || ++files % 4 != 1) continue;  // a quarter: the others take long
        const auto read = read_photometry(test::read_file(entry.path()));
        if (!read) continue;
        const auto again = read_photometry(write_tm33(*read));
        ASSERT_TRUE(again) << entry.path() << again.error().text();
        EXPECT_EQ(again->web.candela, read->web.candela) << entry.path();
    }
    EXPECT_GT(files, 10u);
}

// The order is the schema's (xs:sequence).
TEST(Tm33, WritesTheSchemasOrder) {
    Photometry photometry = *read_photometry(Tm33Text().text());
    photometry.opening = {OpeningShape::box, 0.1 * m, 1.0 * m, 0.05 * m};
    photometry.provenance.keywords = {
        {"MANUFAC", "a<b"}, {"_COLORTEMP", "3000 K"}, {"_CRI", "90"}, {"ISSUEDATE", "May 2024"}};
    const std::string text = write_tm33(photometry);
    std::size_t last = 0;
    for (const char* element : {"<IESTM33-22>",
                                "<Version>1.1</Version>",
                                "<Header>",
                                "<Manufacturer>a&lt;b</Manufacturer>",
                                "<Description>",
                                "<Laboratory>",
                                "<ReportNumber>",
                                "<ReportDate>1970-01-01</ReportDate>",
                                "<Comment>[ISSUEDATE] May 2024</Comment>",
                                "<Equipment>",
                                "<Gonioradiometer>",
                                "<Type>IES_C</Type>",
                                "<Emitter>",
                                "<Quantity>1</Quantity>",
                                "<Description>",
                                "<InputWattage>40</InputWattage>",
                                "<ColorTemperature>",
                                "<FixedCCT>3000</FixedCCT>",
                                "<ColorRendering>",
                                "<Ra>90</Ra>",
                                "<LuminousData>",
                                "<LuminousIntensity>",
                                "<AbsolutePhotometry>true</AbsolutePhotometry>",
                                "<Symm>Symm_Full</Symm>",
                                "<NumberMeasured>3</NumberMeasured>",
                                "<NumberHorz>1</NumberHorz>",
                                "<NumberVert>3</NumberVert>",
                                "<IntData h=\"0\" v=\"0\">100</IntData>",
                                "</LuminousIntensity>",
                                "<LuminousFlux>",
                                "<EmissionAreas>",
                                "<BottomFace>",
                                "<BottomArea>",
                                "<C0Face>",
                                "<C90Face>",
                                "<C180Face>",
                                "<C270Face>",
                                "</EmissionAreas>",
                                "</Emitter>",
                                "</IESTM33-22>"}) {
        const std::size_t found = text.find(element, last);
        ASSERT_NE(found, std::string::npos) << element << " after " << text.substr(0, last);
        last = found + 1;
    }
}

}  // namespace
}  // namespace gonio::ies

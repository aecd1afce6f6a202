// Shared by the photometry tests: tiny files, looks at what was read, and where the shared corpus lies.
#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>

#include "ies/photometry.h"

namespace gonio::ies::test {

// The parts of an LM-63 file; each test changes the one it is about.
struct Lm63Text {
    std::string header = "IES:LM-63-2019\n[TEST] t\n[TESTLAB] l\n[ISSUEDATE] d\n[MANUFAC] m\n";
    std::string tilt = "TILT=NONE\n";
    std::string lamps = "1 -1 1";    // lamps, lumens per lamp, multiplier
    std::string counts = "3 1";      // vertical, horizontal
    std::string type = "1 2";        // type C, metres
    std::string size = "0 0 0";      // width, length, height
    std::string factors = "1 1 40";  // ballast factor, field 12, watts
    std::string v = "0 45 90";
    std::string h = "0";
    std::string candela = "100 50 0";
    std::string tail;

    std::string text() const {
        return header + tilt + lamps + " " + counts + " " + type + " " + size + "\n" + factors + "\n" + v + "\n" + h +
               "\n" + candela + "\n" + tail;
    }
};

inline bool has(const Photometry& photometry, std::string_view code) {
    return std::any_of(photometry.diagnostics.begin(), photometry.diagnostics.end(),
                       [&](const Diagnostic& d) { return d.code == code; });
}

inline int warnings(const Photometry& photometry) {
    return static_cast<int>(std::count_if(photometry.diagnostics.begin(), photometry.diagnostics.end(),
                                          [](const Diagnostic& d) { return d.severity == "warning"; }));
}

// I at (v, h) of the web's own goniometer, cd.
inline double at(const Photometry& photometry, double v_deg, double h_deg) {
    return intensity(photometry.web,
                     direction_of(photometry.web.goniometer, Angle::degrees(v_deg), Angle::degrees(h_deg)))
        .in(cd);
}

inline std::string read_file(const std::filesystem::path& path) {
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

}  // namespace gonio::ies::test

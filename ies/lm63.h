// LM-63 text (IES files, 1986 to 2019) -> PhotometricWeb. The body is read as one stream of numbers, never by line.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "ies/result.h"
#include "ies/web.h"

namespace gonio::ies {

// A tolerated deviation or a note, with a stable code. Errors are Result errors, never diagnostics.
struct Diagnostic {
    std::string code;      // snake_case, stable, e.g. "trailing_data"
    std::string severity;  // "note" or "warning"
    int line = 0;          // 1-based; 0 where no line is meant
    int column = 0;        // 1-based
    std::string message;   // one sentence
};

struct Provenance {
    std::string format;                 // "LM-63-2002", "EULUMDAT", …
    double multiplier = 1.0;            // candela multiplying factor
    double ballast_factor = 1.0;
    double ballast_lamp_factor = 1.0;   // 12th number; scales in 1986 and 1991 files only
    bool absolute = false;              // lumens per lamp = -1
    int lamps = 1;
    double lumens_per_lamp = 0.0;       // lm, as stated; -1 where absolute
    double input_watts = 0.0;
    std::vector<std::pair<std::string, std::string>> keywords;  // in file order, [MORE] joined
};

struct Photometry {
    PhotometricWeb web;
    Provenance provenance;
    std::vector<Diagnostic> diagnostics;
};

inline constexpr std::size_t kMaxFileBytes = 64u << 20;   // larger files are refused: "too_large"
inline constexpr std::size_t kMaxGridValues = 4u << 20;   // nV * nH beyond this is refused: "grid_too_large"

// text: the whole file, any line end, any 8-bit encoding. Errors carry code, "line L column C" and the token.
// Pure function: opens no file (TILT=<file> is reported, never opened). Any thread.
Result<Photometry> read_lm63(std::string_view text);

}  // namespace gonio::ies

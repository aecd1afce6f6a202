// Files that hold several luminaires, or one with several lights.
#pragma once

#include <string>

namespace gonio::ies {

// Which one is meant; empty: the first, and the note `variants` or `emitters` lists the others. GLDF: ids or names.
// TM-33: `emitter` is a number from 1 on, or an emitter's description or catalogue number.
struct Choice {
    std::string variant;
    std::string emitter;
};

}  // namespace gonio::ies

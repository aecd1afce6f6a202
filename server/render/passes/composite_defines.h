// Which variant of passes/composite.frag shows a picture.
#pragma once

#include "server/gl/program.h"
#include "server/scene/view.h"

namespace gonio {

// What a composite is made of. Parts that its view does not show count as absent.
struct CompositeParts {
    View view = View::beauty;
    bool raw = false;         // values in the view's unit, not colours for a display
    bool emissive = false;    // surfaces that shine
    bool openings = false;    // of luminaires
    bool edges = false;       // pixels of several surfaces
    bool haze = false;        // air that scatters light
    bool work_light = false;  // one that follows the eye, in place of all others
    Look look;                // of displays
};
// Result: the options of composite.frag for them. Any thread.
gl::Defines composite_defines(const CompositeParts& parts);
// Result: whether its colours come from `look`, else from the default one.
bool composite_looks(const CompositeParts& parts);

}  // namespace gonio

// What the stream shows of the pictures that were encoded, as one viewer on the same machine has it: while something
// moves, and from when it rests.
#pragma once

#include <iosfwd>
#include <string>

namespace gonio::bench {

struct StreamOptions {
    std::string scene;     // only this one of cornell, atrium
    std::string pictures;  // folder: the worst picture while moving and the first at rest, as encoded and as decoded
    int device = -1;
    bool json = false;
};

// cornell with a luminaire that moves and atrium with a camera that turns, 800×800 at 60 frames a second for 0.8 s,
// then 3 s of rest, with the server's own lane, repeats and refinement. Prints one row per scene: PSNR, FLIP and steps
// on plain surfaces (tests/pictures/coding_error.h), bits, the encoder's time, and the seconds of rest until the
// picture is visually lossless and stays so. Which pictures are encoded does not depend on the machine's speed: time is
// counted. Throws std::runtime_error where there is no GL, no libx264, or a file cannot be written.
void run_stream(const StreamOptions& options, std::ostream& out, std::ostream& progress);

}  // namespace gonio::bench

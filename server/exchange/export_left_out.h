// What a scene's file has no word for. Pure; any thread.
#pragma once

#include <string>
#include <vector>

namespace gonio {
struct Scene;
}  // namespace gonio

namespace gonio::exchange {

// Result: what of the scene export_glb() or export_mvr() leaves out or keeps in another form. It is a line of an import
// report for each kind of thing: "left out: suns, and their light: "sun"". Camera, exposure and look have no line.
std::vector<std::string> left_out_of_glb(const Scene& scene);
std::vector<std::string> left_out_of_mvr(const Scene& scene);

}  // namespace gonio::exchange

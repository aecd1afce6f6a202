// Messages -> text for people and scripts. Pure functions.
#pragma once

#include <string>
#include <string_view>

#include "ies/core/result.h"
#include "protocol/schema/messages.h"

namespace gonio {

// Result: JSON with the original field names and defaults; one line where `compact`, else indented. In reports every
// pass has "light", null for shared passes; captures come without their image bytes.
std::string to_json(const google::protobuf::Message& message, bool compact);

// Result: the JSON of a part of the message. The path is names joined by dots and indices in brackets. An element of a
// list of named things also goes by its name: "lights[0].aim", "lights.key.aim", "camera.eye[1]". Empty: all. Errors:
// "not_found" with the part of the path that leads nowhere.
Result<std::string> json_at(const google::protobuf::Message& message, std::string_view path, bool compact);

// Result: how far a reference job is, in one line for a terminal.
std::string progress_line(const v1::Progress& progress);

// Result: a line for each cue, and how it is played.
std::string cue_table(const v1::State& state);

std::string report_table(const v1::FrameReport& report);

// Result: a line for each profile: name, lm, cd, beam and field in degrees, W, what it is or why it is none.
std::string library_table(const v1::Library& library);

// Result: a line for each endpoint that is listened at, then one for each sender and universe: who wins, what it sends.
std::string sources_table(const v1::Sources& sources);

// Result: a line for each light, for each group of lights, for each preset, for each saved view of the camera.
std::string lights_table(const v1::State& state);
std::string groups_table(const v1::State& state);
std::string presets_table(const v1::State& state);
std::string views_table(const v1::State& state);

// Result: a line for each show, for each gel.
std::string shows_table(const v1::Shows& shows);
std::string gels_table(const v1::Gels& gels);

}  // namespace gonio

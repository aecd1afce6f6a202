// What JOB.json says -> plain data. Throws job::Refused with place and value. Only for .cpp files, because it brings
// nlohmann::json.
#pragma once

#include <string>

#include "protocol/schema/messages.h"
#include "server/sequence/job_json.h"
#include "server/sequence/sequence.h"

namespace gonio::sequence {

// Refuses what leaves the folder: an absolute name, "..", a hidden file.
void check_inside(const std::string& name, const std::string& place);

// Result: what a capture of a job asks for; the names beside its own that it may have are not looked at.
v1::CaptureQuery query_of(const job::Json& capture, const std::string& format, const std::string& place);

// Result: "2026-02-28T12:00:00Z" as EXR has it: "2026:02:28 12:00:00"; of a job without a date 1970.
std::string exr_date_of(const job::Json& object, const std::string& place);

// sequence: the job's field of that name.
Sequence sequence_of(const job::Json& sequence);

}  // namespace gonio::sequence

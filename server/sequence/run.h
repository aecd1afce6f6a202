// Makes the files of a sequence, of one shard of it. What is there and complete is kept: a run that was killed goes on
// where it was. Render thread.
#pragma once

#include <functional>
#include <stop_token>
#include <string>

#include "server/sequence/sequence.h"
#include "server/session/scene_access.h"

namespace gonio {

struct Scene;
class Renderer;
}  // namespace gonio

namespace gonio::sequence {

// Of sysexits(3) and of Slurm's RequeueExit: what farms go by.
inline constexpr int kDone = 0, kUsage = 2, kTryAgain = 75, kBadJob = 78;

struct RunOptions {
    std::string out;  // folder
    Shard shard;
    bool json = false;                    // lines of JSON, never a bar
    std::string isa;                      // as asked for: "auto", "avx2", "avx512"
    std::string version;                  // of the program
    std::string settings;                 // further options that change the pictures
    std::string isa_used;                 // lighting::isa_in_use()
    std::function<Renderer&()> renderer;  // made when it is asked for
    std::function<std::string()> gl;      // what it runs on, where there is one
};

// First goes through all frames without a picture, so that a job that is refused writes nothing. Result: the exit code.
// kDone; kTryAgain: a stop, or a file that could not be written; kUsage: the folder cannot be made or written. Throws
// job::Refused: kBadJob.
int run_sequence(const Sequence& sequence, const Scene& scene, const SceneAccess& access, const RunOptions& options,
                 const std::stop_token& stop);

}  // namespace gonio::sequence

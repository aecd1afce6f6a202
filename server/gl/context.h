// A headless GL 4.5 core context on EGL. Displays are tried in order: every EGL device (EGL_EXT_platform_device), then
// Mesa's surfaceless platform, so that a GPU is found where there is one and llvmpipe elsewhere.
#pragma once

#include <atomic>
#include <memory>
#include <string>

namespace gonio::gl {

struct ContextOptions {
    int device = -1;     // index of the EGL device to use; -1: first that works
    bool debug = false;  // KHR_debug messages of high and medium severity are counted
};

class Context {
public:
    // Makes the context current on the calling thread. Throws std::runtime_error with one sentence if there is none.
    static std::unique_ptr<Context> create(const ContextOptions& options);
    virtual ~Context() = default;

    virtual std::string description() const = 0;  // one line: display, vendor, renderer, version
    virtual std::string renderer() const = 0;
    virtual bool software() const = 0;       // llvmpipe, softpipe, swrast
    virtual int debug_messages() const = 0;  // since the start; 0 in a correct program
    virtual std::string last_debug_message() const = 0;
    // Result: whether the GPU lost the context (GL_ARB_robustness); everything must be rebuilt then.
    virtual bool lost() const = 0;
};

}  // namespace gonio::gl

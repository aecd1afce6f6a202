#include "server/trace/reference.h"

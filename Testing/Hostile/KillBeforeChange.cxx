// Preloaded, it ends a program by SIGKILL just before a file gets its final name, or is removed: the moments at which
// a set of files is half there. DYNAMICCORONARY_KILL_BEFORE is how the path ends; what lies in hidden folders and
// hidden files do not count.
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include <dlfcn.h>
#include <unistd.h>

namespace
{
void KillBefore(const char* path)
{
  const char* end = std::getenv("DYNAMICCORONARY_KILL_BEFORE");
  if (!end || std::strstr(path, "/."))
  {
    return;
  }
  const std::size_t length = std::strlen(path);
  const std::size_t last = std::strlen(end);
  if (last <= length && std::strcmp(path + length - last, end) == 0)
  {
    raise(SIGKILL);
  }
}

template <typename Function>
Function* Next(const char* name)
{
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}
}

extern "C" int rename(const char* from, const char* to) noexcept
{
  KillBefore(to);
  return Next<int(const char*, const char*)>("rename")(from, to);
}

extern "C" int remove(const char* path) noexcept
{
  KillBefore(path);
  return Next<int(const char*)>("remove")(path);
}

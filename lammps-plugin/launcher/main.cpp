/* psidpd-lmp: LAMMPS with psidpd's styles, for a LAMMPS that has no plugins.

   Takes the arguments of lmp and behaves as lmp does, under mpirun too. */

#include "fix.h"
#include "force.h"
#include "input.h"
#include "lammps.h"
#include "library.h"
#include "modify.h"
#include "pointers.h"
#include "utils.h"

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <dlfcn.h>
#include <exception>
#include <map>
#include <mpi.h>
#include <string>
#include <typeinfo>

using namespace LAMMPS_NS;

// Defined by the plugin.
extern "C" const char *psidpd_register(void *lmp);

// library.h declares lammps_open for some settings of the host only.
extern "C" void *lammps_open(int argc, char **argv, MPI_Comm comm, void **ptr);

namespace {

bool hooked = false;            // LAMMPS calls our post_create
const char *trouble = nullptr;  // why the styles could not be registered

[[noreturn]] void leave(const char *text)
{
  int rank = 0, size = 1;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  if (rank == 0 && text) fprintf(stderr, "ERROR: %s\n", text);
  fflush(nullptr);
  if (size > 1) MPI_Barrier(MPI_COMM_WORLD);
  MPI_Finalize();
  exit(1);
}

// LAMMPS has printed the error. An error on some ranks only must stop the other ranks.
[[noreturn]] void stop(const std::exception &e)
{
  fflush(nullptr);
  if (strstr(typeid(e).name(), "LAMMPSException")) leave(nullptr);
  if (!strstr(typeid(e).name(), "LAMMPS")) fprintf(stderr, "ERROR: %s\n", e.what());
  MPI_Abort(MPI_COMM_WORLD, 1);
  exit(1);
}

// Kind and name of each style.
constexpr const char *STYLES[][2] = {
    {"pair", "dpd/psi"}, {"pair", "mdpd/psi"}, {"pair", "dpd/spline"}, {"fix", "dpd/splitting"}};

// 'plugin load .../psidpdplugin.so', 'plugin list' and 'plugin unload pair|fix STYLE', so that a script
// for a LAMMPS with plugins runs here unchanged. The class has the same virtual functions, in the same
// order, as LAMMPS's class of commands, whose header is not always installed.
class PluginCommand : protected Pointers {
 public:
  explicit PluginCommand(LAMMPS *lmp) : Pointers(lmp) {}

  virtual void command(int narg, char **arg)
  {
    const std::string verb = narg > 0 ? arg[0] : "";
    if (verb == "load" && narg == 2)
      load(arg[1]);
    else if (verb == "list" && narg == 1)
      list();
    else if (verb == "unload" && narg == 3)
      unload(arg[1], arg[2]);
    else
      leave("psidpd-lmp understands the plugin command as 'plugin load psidpdplugin.so', 'plugin list' and "
            "'plugin unload pair STYLE' or 'plugin unload fix STYLE' only");
  }

 private:
  bool has(const std::string &kind, const char *name) const
  {
    return kind == "fix" ? modify->fix_map->count(name) > 0 : force->pair_map->count(name) > 0;
  }

  void load(const char *path)
  {
    const char *slash = strrchr(path, '/');
    const char *refusal = "psidpd-lmp has the styles of psidpdplugin.so and can load no other plugin";
    if (strcmp(slash ? slash + 1 : path, "psidpdplugin.so") == 0) refusal = psidpd_register(lmp);
    if (refusal) leave(refusal);
  }

  void list()
  {
    std::string text = "Currently loaded plugins\n";
    int number = 0;
    for (const auto &[kind, name] : STYLES)
      if (has(kind, name)) text += "   " + std::to_string(++number) + ": " + kind + " style plugin " + name + "\n";
    utils::logmesg(lmp, text);
  }

  void unload(const std::string &kind, const char *name)
  {
    bool ours = false;
    for (const auto &[sort, known] : STYLES) ours |= kind == sort && strcmp(known, name) == 0 && has(kind, name);
    if (!ours) {
      utils::logmesg(lmp, "Ignoring unload of " + kind + " style " + name + ": not from a plugin\n");
      return;
    }
    utils::logmesg(lmp, "Unloading " + kind + " style " + name + "\n");
    // LAMMPS too removes a style that is in use, be it a pair style alone or in a hybrid.
    if (kind == "fix") {
      for (int k = modify->nfix - 1; k >= 0; k--)
        if (strcmp(modify->fix[k]->style, name) == 0) modify->delete_fix(k);
      modify->fix_map->erase(name);
      return;
    }
    if (force->pair_match(name, 1)) force->create_pair("none", 0);
    force->pair_map->erase(name);
  }
};

Command *create_plugin_command(LAMMPS *lmp)
{
  return reinterpret_cast<Command *>(new PluginCommand(lmp));
}

}    // namespace

// LAMMPS calls this after it has created its classes, at the start and after 'clear'. The dynamic
// linker prefers this definition to the library's, which this function calls first.
void LAMMPS::post_create()
{
  using Function = void (*)(LAMMPS *);
  static const auto original = reinterpret_cast<Function>(dlsym(RTLD_NEXT, "_ZN9LAMMPS_NS6LAMMPS11post_createEv"));
  if (original) original(this);
  hooked = true;
  trouble = psidpd_register(this);
}

int main(int argc, char **argv)
{
  MPI_Init(&argc, &argv);
  // The library allocates the instance, whose size it knows; nothing here reads it before the versions agree.
  void *handle = nullptr;
  try {
    handle = lammps_open(argc, argv, MPI_COMM_WORLD, nullptr);
    if (!handle) leave(nullptr);
    if (!hooked) trouble = psidpd_register(handle);
    if (trouble) leave(trouble);
    auto *lmp = static_cast<LAMMPS *>(handle);
    lmp->input->command_map->emplace("plugin", create_plugin_command);
    lmp->input->file();
  } catch (const std::exception &e) {
    stop(e);
  }
  lammps_close(handle);
  lammps_kokkos_finalize();
  lammps_python_finalize();
  MPI_Barrier(MPI_COMM_WORLD);
  MPI_Finalize();
  return 0;
}

/* What tests need beside the functions of the header. */
#include "engine_mount_controller.h"

engine_mount_state_memory_t *state_of(engine_mount_controller_t *controller)
{
    return &controller->state;
}

void run(engine_mount_controller_t *controller, const int64_t *stamps, const double *displacements,
         const double *frequencies, int64_t count, double *currents, engine_mount_trace_memory_t *traces)
{
    for (int64_t n = 0; n < count; n++) {
        currents[n] = engine_mount_controller_step(controller, stamps[n], displacements[n], frequencies[n]);
        traces[n] = controller->trace;
    }
}

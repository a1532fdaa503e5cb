// Loop trips left to the invocation, in kernels without trees whose surfaces take trips that nobody knows beforehand: see counted.wgsl.
// In kernels with trees tree/walk.wgsl declares it.

var<private> trips_left: u32 = 0xffffffffu;

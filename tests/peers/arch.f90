! The planar elastica between two clamps for AUTO-07p: U = (x, z, theta, kappa), PAR(1) how far the end is shifted along z,
! PAR(2), PAR(3) the force on it:  theta'' = F_x sin(theta) - F_z cos(theta).  The first solution is read from a table.
module arch_case
  implicit none
  integer, save :: count = 0
  double precision, save :: span, first, last, force(2), shift
  double precision, save, allocatable :: table(:, :)
end module

subroutine begin_case
  use arch_case
  implicit none
  integer :: i
  if (count > 0) return
  open(77, file='case.txt', status='old')
  read(77, *) count, span, first, last, shift, force
  allocate(table(5, count))
  do i = 1, count
    read(77, *) table(:, i)
  end do
  close(77)
end subroutine

subroutine func(ndim, u, icp, par, ijac, f, dfdu, dfdp)
  implicit none
  integer, intent(in) :: ndim, icp(*), ijac
  double precision, intent(in) :: u(ndim), par(*)
  double precision, intent(out) :: f(ndim)
  double precision, intent(inout) :: dfdu(ndim, ndim), dfdp(ndim, *)
  f(1) = cos(u(3)); f(2) = sin(u(3)); f(3) = u(4)
  f(4) = par(2)*sin(u(3)) - par(3)*cos(u(3))
  if (ijac == 0) return
  dfdu = 0d0
  dfdu(1,3) = -sin(u(3)); dfdu(2,3) = cos(u(3)); dfdu(3,4) = 1d0
  dfdu(4,3) = par(2)*cos(u(3)) + par(3)*sin(u(3))
  if (ijac == 1) return
  dfdp(1:ndim,1:3) = 0d0
  dfdp(4,2) = sin(u(3)); dfdp(4,3) = -cos(u(3))
end subroutine

subroutine stpnt(ndim, u, par, t)
  use arch_case
  implicit none
  integer, intent(in) :: ndim
  double precision, intent(inout) :: u(ndim), par(*)
  double precision, intent(in) :: t
  integer :: i
  double precision :: part
  call begin_case
  par(1) = shift; par(2:3) = force
  i = min(1 + int(t*(count - 1)), count - 1)
  part = (t - table(1, i))/(table(1, i+1) - table(1, i))
  u(1:4) = (1d0 - part)*table(2:5, i) + part*table(2:5, i+1)
end subroutine

subroutine bcnd(ndim, par, icp, nbc, u0, u1, fb, ijac, dbc)
  use arch_case
  implicit none
  integer, intent(in) :: ndim, icp(*), nbc, ijac
  double precision, intent(in) :: par(*), u0(ndim), u1(ndim)
  double precision, intent(out) :: fb(nbc)
  double precision, intent(inout) :: dbc(nbc, *)
  call begin_case
  fb(1) = u0(1); fb(2) = u0(2); fb(3) = u0(3) - first
  fb(4) = u1(1) - span; fb(5) = u1(2) - par(1); fb(6) = u1(3) - last
  if (ijac == 0) return
  dbc(:, 1:2*ndim) = 0d0
  dbc(1,1) = 1d0; dbc(2,2) = 1d0; dbc(3,3) = 1d0
  dbc(4,ndim+1) = 1d0; dbc(5,ndim+2) = 1d0; dbc(6,ndim+3) = 1d0
  if (ijac == 1) return
  dbc(:, 2*ndim+1:2*ndim+3) = 0d0
  dbc(5, 2*ndim+1) = -1d0
end subroutine

subroutine icnd(ndim, par, icp, nint, u, uold, udot, upold, fi, ijac, dint)
  integer ndim, icp(*), nint, ijac
  double precision par(*), u(*), uold(*), udot(*), upold(*), fi(*), dint(nint, *)
end subroutine

subroutine fopt(ndim, u, icp, par, ijac, fs, dfdu, dfdp)
  integer ndim, icp(*), ijac
  double precision u(*), par(*), fs, dfdu(*), dfdp(*)
end subroutine

subroutine pvls(ndim, u, par)
  integer ndim
  double precision u(*), par(*)
end subroutine
